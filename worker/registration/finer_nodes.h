// A second level of deformation nodes, closer together, where a registration that was carried over
// from a coarser mesh is still far from its target. Internal to worker/registration.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "worker/registration/complete.h"
#include "worker/registration/fit/state.h"
#include "worker/registration/registration.h"

namespace liquidblend::registration {

// Cuts the regions out of the moved source that are further than options.finer_from_edges from the
// target (in either direction), with a margin, and registers this cutout alone: a few iterations,
// nodes as far apart as the options say, its rim held. The rest of the displacement stays. The
// cutout has at most as many vertices as are registered at once, the worst places first. If much is
// left out, there is another round, at most three in all.
//   state  the displacement, the count of nodes that were added (0 if nothing is far), and the
//          rounds that are done, which are skipped
//   keep   called after each round
// Errors: kInternal if the solver breaks down.
// Threads: same bytes for any thread count.
absl::Status RefineUnderfitRegions(const SurfacePair& pair, const RegistrationOptions& options,
                                   const parallel::Arena& arena, const std::function<void()>& keep,
                                   SharpenState& state);

}  // namespace liquidblend::registration

// A second level of nodes, closer together, where a registration that was carried over from a
// coarser mesh is still far from its target. Internal to worker/registration.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "worker/registration/complete.h"
#include "worker/registration/fit/state.h"
#include "worker/registration/registration.h"

namespace liquidblend::registration {

// Cuts out what is further than options.finer_from_edges from the target (or what the target is
// from) with what is around it, as moved, and registers that alone: nodes as far apart as the
// options say, all of its rim held, a few iterations. The rest of the displacement stays. No more
// take part at a time than are registered at once, the worst places first; if there was no room for
// much of it, again, three times in all at most.
//   state  rounds that are done, or not needed, are not done again; has the displacement, and
//          counts the nodes: none if nothing is far
//   keep   called after each round
// Errors: kInternal if the solver breaks down.
// Threads: same bytes for any thread count.
absl::Status FitWhatIsFar(const SurfacePair& pair, const RegistrationOptions& options,
                          const parallel::Arena& arena, const std::function<void()>& keep,
                          SharpenState& state);

}  // namespace liquidblend::registration

// A second level of nodes, closer together, where a registration that was carried over from a
// coarser mesh is still far from its target. Internal to worker/registration.
#pragma once

#include "absl/status/statusor.h"
#include "worker/registration/complete.h"
#include "worker/registration/register.h"

namespace liquidblend::registration {

// Cuts out what is further than options.finer_from_edges from the target (or what the target is
// from) with what is around it, as moved, and registers that alone: nodes as far apart as
// options.node_spacing_edges, all of its rim held, a few iterations that begin stiff; a few times.
// The rest of the displacement stays. No more take part at a time than are registered at once, the
// worst places first.
//   displacement  in edges and frames
// Returns the number of nodes: 0 if nothing is far.
// Errors: kInternal if the solver breaks down.
// Threads: same bytes for any thread count.
absl::StatusOr<int> FitWhatIsFar(const SurfacePair& pair, const RegistrationOptions& options,
                                 const parallel::Arena& arena, Points& displacement);

}  // namespace liquidblend::registration

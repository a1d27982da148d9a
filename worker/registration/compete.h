// Competition of pairings: where a registration is not good, and the features of both animations
// can be paired in another way, that is tried, too.
#pragma once

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"
#include "worker/registration/fit/state.h"
#include "worker/registration/registration.h"

namespace liquidblend::registration {

// Index of the pairing that wins: the first one, unless another costs less than half as much; then
// the least.  Requires: costs is not empty.
size_t WinnerOf(const std::vector<double>& costs);

// The pairing that was kept: `tried_first` if no other one was tried.
Pairing KeptPairing(const std::vector<mesh::Hypothesis>& hypotheses, Pairing tried_first);

// Registers source and target with options.pairing. If the verdict is not good, the cost at least
// 2.5, correspondences are automatic and there are 8 iterations or more, the other ways are tried,
// too: with the pairs found, with two detached parts' partners exchanged, without pairs. The first
// one wins unless another one loses less than half as much (CostOf() of its verdict). The report
// lists what was tried; nothing if there was no choice.
//   hooks  keep: with a CompetitionState once others are tried; resume: that, or an iteration's of
//          the first one
// Cost: that of Register() for each one tried; after an interruption also that of completing the
// best one again, if it was tried before.
// Errors: those of Register(); a way that cannot be registered loses.
// Threads: safe, same bytes for any thread count.
absl::StatusOr<Registration> RegisterWithBestPairing(const mesh::SpaceTimeMesh& source,
                                                     const mesh::SpaceTimeMesh& target,
                                                     const std::vector<Correspondence>& users,
                                                     const RegistrationOptions& options,
                                                     const parallel::Arena& arena,
                                                     const RegistrationHooks& hooks = {});

}  // namespace liquidblend::registration

// Competition of pairings: where the features of two animations can be paired in more than one way,
// each is tried on coarse meshes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"
#include "worker/registration/registration.h"

namespace liquidblend::registration {

struct Competition {
  Pairing winner = Pairing::kFound;
  std::vector<mesh::Hypothesis> hypotheses;  // in the order tried; none: there was no choice
};

// The index of the pairing that wins: the first one, unless another costs less than half as much;
// then the least.  Requires: costs is not empty.
size_t WinnerOf(const std::vector<double>& costs);

// The factor by which the edges of the coarse meshes are longer than those of a mesh of so many
// vertices.
double CompetitionScale(int64_t num_vertices);

// Registers coarse meshes in each way: with the pairs found, with two detached parts' partners
// exchanged, and without pairs. The pairs found win unless another way loses less than half as much
// (CostOf() of its verdict). There is no choice where nothing is found, or where a registration is
// not automatic.
//   scale    of the coarse meshes
//   options  of the registration that follows
// Errors: as Register().  Threads: same bytes for any thread count.
absl::StatusOr<Competition> Compete(const mesh::SpaceTimeMesh& source,
                                    const mesh::SpaceTimeMesh& target, double scale,
                                    const std::vector<Correspondence>& users,
                                    const RegistrationOptions& options,
                                    const parallel::Arena& arena);

}  // namespace liquidblend::registration

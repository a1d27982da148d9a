// What a checkpoint must agree with to be gone on from.
#pragma once

#include <string>

#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::jobs {

// A hash of all that the bytes of a target's registration come from: the job, the meshes, what is
// refined (or null), and this program, since another one may do the same differently.
// Cost: O(bytes); the first time those of the program's file, too.
std::string FingerprintOf(const store::v1::RegisterJob& job, int target_index,
                          const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target,
                          const mesh::RegisteredFamily* previous);

}  // namespace liquidblend::jobs

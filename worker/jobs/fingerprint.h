// Fingerprints of registrations: a checkpoint can be resumed only by a registration with the same
// one.
#pragma once

#include <string>

#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::jobs {

// A hash of all input of a target's registration: the job, the meshes, the registration that is
// refined (or null), and this program, since another version may compute different bytes.
// Cost: O(bytes); the first time the bytes of the program's file, too.
std::string FingerprintOf(const store::v1::RegisterJob& job, int target_index,
                          const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target,
                          const mesh::RegisteredFamily* previous);

}  // namespace liquidblend::jobs

// Target files: the registration of one target, from the worker that made it to the one
// that assembles the family.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "core/mesh/space_time_mesh.h"
#include "core/store/blobs/blob_store.h"
#include "worker/jobs/assemble_family.h"

namespace liquidblend::jobs {

// Hash of all data of the mesh that the family keeps. Cost: O(bytes).
std::string HashOf(const mesh::SpaceTimeMesh& mesh);

//   source_mesh  hash of the source's mesh that was registered; empty: not known
// Errors: those of the store.
absl::StatusOr<store::BlobId> StoreTarget(const RegisteredTarget& target,
                                          const std::string& source_mesh, store::BlobStore& blobs);

// Nothing if the target was registered to another mesh of the source, by another version of the
// program. Errors: those of the store; kFailedPrecondition if the file is of another target.
absl::StatusOr<std::optional<RegisteredTarget>> ReadTarget(const store::BlobId& id,
                                                           const std::string& target,
                                                           const std::string& source_mesh,
                                                           store::BlobStore& blobs);

}  // namespace liquidblend::jobs

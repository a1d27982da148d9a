// The registration of one target on its way from the worker that made it to the one that puts the
// family together.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "core/mesh/space_time_mesh.h"
#include "core/store/blobs/blob_store.h"
#include "worker/jobs/assemble_family.h"

namespace liquidblend::jobs {

// Of all that the family keeps of the mesh. Cost: O(bytes).
std::string HashOf(const mesh::SpaceTimeMesh& mesh);

//   source_mesh  hash of the mesh that the target is a registration of; empty: not known
// Errors: those of the store.
absl::StatusOr<store::BlobId> StorePart(const RegisteredTarget& target,
                                        const std::string& source_mesh, store::BlobStore& blobs);

// Errors: those of the store; kFailedPrecondition if the part is of another target, or of a
// source's mesh with another hash: the workers are not the same program.
absl::StatusOr<RegisteredTarget> ReadPart(const store::BlobId& id, const std::string& target,
                                          const std::string& source_mesh, store::BlobStore& blobs);

}  // namespace liquidblend::jobs

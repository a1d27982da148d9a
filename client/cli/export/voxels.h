// Memory of a level set: whether that of a surface is one that a machine can hold.
#pragma once

#include "absl/status/status.h"
#include "liquidblend/mesh.h"

namespace liquidblend::cli {

// Estimates the memory that a level set around a surface takes, from the nodes of the tree that
// OpenVDB keeps it in: thin, long and scattered triangles take far more than their area says.
// Refuses what takes more than some 24 GB, and coordinates beyond whole numbers of 32 bits.
//   voxel_size_m  > 0
// Requires: indices in range, positions finite.  Errors: kInvalidArgument.
// Cost: O(n + area in squares of a voxel); at most seconds.
absl::Status CheckVoxels(const Mesh& mesh, double voxel_size_m);

}  // namespace liquidblend::cli

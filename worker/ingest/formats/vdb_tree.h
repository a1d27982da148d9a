// The voxels of an OpenVDB grid -> the library's own tree.
#pragma once

#include <openvdb/openvdb.h>

#include "absl/status/statusor.h"
#include "worker/ingest/formats/vdb_file.h"

namespace liquidblend::ingest {

// Voxels farther from the origin than this many are refused: positions are floats.
inline constexpr int kMaxVdbIndex = 1 << 20;

// The trees of type Tree_float_5_4_3 and Tree_vec3s_5_4_3.
// Errors: kInvalidArgument, kDataLoss; values that are not finite included.
// Memory: at most 96 bytes for each byte of grid.tree, and 1 MiB.
absl::StatusOr<openvdb::FloatTree::Ptr> ReadVdbFloatTree(const VdbGrid& grid);
absl::StatusOr<openvdb::Vec3STree::Ptr> ReadVdbVectorTree(const VdbGrid& grid);

}  // namespace liquidblend::ingest

// Structure of an OpenVDB file. Our own code reads it and the trees (vdb_tree.h), because the
// library trusts the sizes and counts of a file and allocates accordingly.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace liquidblend::ingest {

struct VdbGrid {
  std::string name;
  std::string type;          // of the tree: Tree_float_5_4_3
  std::string grid_class;    // "level set", "fog volume", "staggered", "unknown" or empty
  bool is_half = false;      // values are 16-bit floats
  uint32_t compression = 0;  // kVdbZip ...
  Eigen::Matrix4d world_from_index = Eigen::Matrix4d::Identity();  // affine, invertible
  std::span<const std::byte> tree;  // its topology and buffers, a part of the file
};

constexpr uint32_t kVdbZip = 1;
constexpr uint32_t kVdbActiveMask = 2;
constexpr uint32_t kVdbBlosc = 4;

// All grids of a file with an index (openvdb::io::File), in its order; file format 222 to 224, that
// is, OpenVDB 3 and later. Grids that share the tree of another one, and those whose transform is
// not affine, are left out. Names are without the number that distinguishes equal ones.
// Errors: kInvalidArgument, kDataLoss.  Memory: a few times the names in the file.
absl::StatusOr<std::vector<VdbGrid>> ReadVdbGrids(std::span<const std::byte> bytes);

}  // namespace liquidblend::ingest

// Faces with any number of corners -> triangles.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

namespace liquidblend::ingest {

struct Polygons {
  std::vector<int32_t> corners;      // vertex indices from 0, all faces behind one another
  std::vector<int32_t> num_corners;  // per face
  int64_t first_number = 0;          // what the file counts vertices and faces from, for messages
};

// Cuts a quad along the diagonal that keeps both triangles facing the same way, the shorter one if
// both do, and a larger face into the fan of its first corner: right in area and volume for flat
// faces, meant for convex ones.
// Errors: kInvalidArgument with the first face that has fewer than 3 corners or names a vertex out
// of range, or if there are more triangles than int32 counts.
absl::StatusOr<Eigen::Matrix3Xi> Triangulate(const Polygons& polygons,
                                             const Eigen::Matrix3Xf& vertices);

}  // namespace liquidblend::ingest

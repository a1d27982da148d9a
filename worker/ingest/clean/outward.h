// Orientation of a frame as a whole, and of its parts.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::ingest {

// Errors: kInvalidArgument if there are triangles and their signed volume is not above 0.
absl::Status CheckOutward(const mesh::TriangleMesh& mesh);

struct TurnedParts {
  int64_t count = 0;
  Eigen::Vector3f first = Eigen::Vector3f::Zero();  // a vertex of the first one
};

// Turns the triangles of those connected parts that are inside out: they bound no liquid, because
// the winding number is above 0 on neither side. A drop that faces inward is one, in the air as in
// a bubble; a bubble in liquid and a drop in a bubble are none. Parts that enclose no volume stay.
// So does all, if the signed volume would not be above 0 any more. Requires: a closed, oriented
// manifold whose signed volume is above 0. Errors: kInvalidArgument if thousands of large parts
// face inward, which would take too long. Cost: O(n) unless a part faces inward; else O(n log n),
// at most 1000 times n.
absl::StatusOr<TurnedParts> TurnPartsOutward(mesh::TriangleMesh& mesh);

}  // namespace liquidblend::ingest

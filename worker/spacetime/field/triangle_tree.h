// Distances of points to a triangle surface, near or far. Internal to worker/spacetime.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::spacetime {

// A tree of boxes around triangles.  Threads: Distance() is safe.
class TriangleTree {
 public:
  // The surface must outlive the tree. Requires: indices in range, finite vertices.
  // Cost: O(n log n).
  explicit TriangleTree(const mesh::TriangleMesh& surface);

  bool empty() const { return nodes_.empty(); }
  // Distance in metres, exact up to rounding. Requires: !empty().
  float Distance(const Eigen::Vector3f& point) const;

 private:
  struct Node {
    Eigen::AlignedBox3f box;
    int32_t begin = 0, end = 0;  // of a leaf, in triangles_
    int32_t second = -1;         // the second child (the first one comes next); -1: a leaf
  };

  int32_t AddNode(const Eigen::Matrix3Xf& centres, int32_t begin, int32_t end);
  float LeafDistanceSq(const Node& leaf, const Eigen::Vector3f& point) const;

  const mesh::TriangleMesh& surface_;
  std::vector<int32_t> triangles_;  // leaf by leaf
  std::vector<Node> nodes_;
};

}  // namespace liquidblend::spacetime

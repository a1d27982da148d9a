// The blend that one gets without registration: of signed distances, frame by frame.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::accuracy {

// Distances to a closed surface at the points of a regular grid, negative inside, metres; exact.
class SignedDistances {
 public:
  // Cost: O(grid points log triangles).
  SignedDistances(const mesh::TriangleMesh& surface, const Eigen::AlignedBox3f& box,
                  double spacing_m);

  // Requires: (i, j, k) inside the box.
  float At(const Eigen::Vector3i& point) const {
    return values_[(static_cast<size_t>(point[2]) * size_[1] + point[1]) * size_[0] + point[0]];
  }
  const Eigen::Vector3i& size() const { return size_; }

 private:
  Eigen::Vector3i size_;  // points per axis
  std::vector<float> values_;
};

// The zero level of the weighted sum of the surfaces' distances.
//   weights  one per surface; they should add up to 1
mesh::TriangleMesh BlendDistances(const std::vector<const mesh::TriangleMesh*>& surfaces,
                                  const std::vector<double>& weights, double spacing_m);

}  // namespace liquidblend::accuracy

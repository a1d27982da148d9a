// How far apart two surfaces are.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::synthetic {

// Distances of points to a triangle surface (Embree point queries).
// Threads: Distance() is safe.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const mesh::TriangleMesh& surface);
  ~SurfaceDistance();
  SurfaceDistance(SurfaceDistance&&) noexcept;

  // Metres; infinity without triangles.
  float Distance(const Eigen::Vector3f& point) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Mean of the mean distances of the vertices of each surface to the other one, metres.
double MeanSymmetricDistance(const mesh::TriangleMesh& a, const mesh::TriangleMesh& b);

}  // namespace liquidblend::synthetic

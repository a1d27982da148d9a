// Heights of the liquid's surface seen from above, at one time. Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "core/mesh/up.h"

namespace liquidblend::registration {

// The two coordinates of a point that are not its height, in the order of the axes.
Eigen::Vector2d PlaceOf(const Eigen::Vector3d& point, const mesh::HeightAxis& up);

// The point at a place and height.
Eigen::Vector3d PointAt(const Eigen::Vector2d& place, double height, const mesh::HeightAxis& up);

// The part of a surface that is seen: all of it, or the largest connected part, so that detached
// drops and bubbles do not hide the pool.
enum class Seen { kAll, kLargestPart };

// Heights on a square grid, in the unit of the surface that they are of.
class HeightField {
 public:
  // Looks from above, within `half_width` of the centre along both axes.
  //   surface  closed, counter-clockwise seen from outside
  // Requires: half_width > 0, spacing > 0.  Cost: O(triangles + grid points below them).
  HeightField(const mesh::TriangleMesh& surface, const mesh::HeightAxis& up,
              const Eigen::Vector2d& centre, double half_width, double spacing, Seen seen);

  // The height at a place, linear between grid points; NaN outside of the grid, and where a grid
  // point around it has no liquid.
  double At(const Eigen::Vector2d& place) const;

  double spacing() const { return spacing_; }
  // Grid points along each axis, the place of one, and its height or NaN.
  int size() const { return size_; }
  Eigen::Vector2d PlaceOfPoint(int i, int j) const {
    return low_ + spacing_ * Eigen::Vector2d(i, j);
  }
  double At(int i, int j) const { return heights_[static_cast<size_t>(j) * size_ + i]; }

 private:
  void AddTriangle(const Eigen::Matrix<double, 3, 3>& corners);
  double& Point(int i, int j) { return heights_[static_cast<size_t>(j) * size_ + i]; }

  Eigen::Vector2d low_;  // the first grid point
  double spacing_;
  int size_;                     // grid points along each axis
  std::vector<double> heights_;  // size_ x size_; NaN: no liquid
};

}  // namespace liquidblend::registration

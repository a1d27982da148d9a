// Crossings of axis-parallel rays with a surface. Internal to worker/registration, and for tests.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::registration {

// A bundle of rays along one axis, a regular grid across it.
struct RayGrid {
  int axis = 2;  // 0, 1, 2: along x, y, z
  // Place of ray (0, 0), in the two axes after `axis` (cyclic: y and z for x), metres.
  Eigen::Vector2d first_m = Eigen::Vector2d::Zero();
  double spacing_m = 1.0;  // > 0
  std::array<int, 2> counts = {0, 0};
};

// Rays for the search of inverted places: their spacing in mean edges, and the offset of the first.
inline constexpr double kRaySpacing = 0.5;
inline constexpr double kRayOffset = 0.4;  // of the spacing

// Rays along an axis through all of a surface; the first lies `offset` spacings inside of its box.
// No more than 1,024 rays along any side of the box: further apart if it is larger.
RayGrid RaysThrough(const mesh::TriangleMesh& surface, int axis, double spacing_m, double offset);

struct Crossing {
  float depth_m;  // coordinate along the axis
  int step;       // of the winding number: 1 into the surface, -1 out of it
  int32_t triangle;
};

// The crossings of all rays with a surface. A ray through an edge or a vertex counts as a ray
// beside it, so that the steps of each ray add up to 0 if the surface is closed.
// Cost: O(triangles + crossings log crossings).
class AxisRays {
 public:
  AxisRays(const mesh::TriangleMesh& surface, const RayGrid& grid);

  // Crossings of a ray in the order of their depths; at the same depth the entering ones come
  // first.
  std::span<const Crossing> Crossings(int u, int v) const {
    const size_t ray = static_cast<size_t>(v) * grid_.counts[0] + u;
    return {crossings_.data() + begin_[ray], begin_[ray + 1] - begin_[ray]};
  }
  // Winding number of the surface around the ray's point at this depth.
  int Winding(int u, int v, double depth_m) const;

 private:
  RayGrid grid_;
  std::vector<size_t> begin_;        // per ray, u fastest, and the end: in `crossings_`
  std::vector<Crossing> crossings_;  // ray by ray
};

// A span of a ray that is inside out: the ray leaves the surface before it enters it.
struct InvertedSpan {
  Eigen::Vector2d at_m;  // the ray, in the two axes after the grid's
  Crossing leaves, enters;
};

std::vector<InvertedSpan> FindInvertedSpans(const mesh::TriangleMesh& surface, const RayGrid& grid);

struct InvertedCrossings {
  int64_t num_crossings = 0;              // of all rays
  std::vector<Eigen::Vector3f> inverted;  // those with a winding number below 0 on one side, metres
};

InvertedCrossings FindInverted(const mesh::TriangleMesh& surface, const RayGrid& grid);

}  // namespace liquidblend::registration

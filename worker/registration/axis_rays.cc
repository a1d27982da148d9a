#include "worker/registration/axis_rays.h"

#include <algorithm>
#include <cmath>

namespace liquidblend::registration {
namespace {

using Eigen::Vector2d;

// Is q on the left of the edge from corner a to corner b? Both triangles of an edge ask with the
// same numbers in the same order and get opposite answers. A q on the edge is taken to lie a little
// further along u, and much less along v, so that around a vertex one triangle alone has it.
bool IsLeft(int index_a, const Vector2d& a, int index_b, const Vector2d& b, const Vector2d& q,
            double& area) {
  const bool swapped = index_a > index_b;
  const Vector2d& from = swapped ? b : a;
  const Vector2d& to = swapped ? a : b;
  const Vector2d edge = to - from, offset = q - from;
  const double side = edge.x() * offset.y() - edge.y() * offset.x();
  area = swapped ? -side : side;
  const bool on_left = side != 0 ? side > 0 : edge.y() != 0 ? edge.y() < 0 : edge.x() > 0;
  return on_left != swapped;
}

}  // namespace

RayGrid RaysThrough(const mesh::TriangleMesh& surface, int axis, double spacing_m, double offset) {
  const Eigen::Vector3d low = surface.vertices.rowwise().minCoeff().cast<double>();
  const Eigen::Vector3d high = surface.vertices.rowwise().maxCoeff().cast<double>();
  RayGrid grid;
  grid.axis = axis;
  grid.spacing_m = spacing_m;
  for (int k = 0; k < 2; ++k) {
    const int across = (axis + 1 + k) % 3;
    grid.first_m[k] = low[across] + offset * spacing_m;
    grid.counts[k] = 1 + static_cast<int>((high[across] - low[across]) / spacing_m);
  }
  return grid;
}

AxisRays::AxisRays(const mesh::TriangleMesh& surface, const RayGrid& grid)
    : grid_(grid), crossings_(static_cast<size_t>(grid.counts[0]) * grid.counts[1]) {
  for (int64_t t = 0; t < surface.num_triangles(); ++t) AddTriangle(surface, t);
  for (auto& ray : crossings_) {
    std::sort(ray.begin(), ray.end(), [](const Crossing& a, const Crossing& b) {
      return a.depth_m != b.depth_m ? a.depth_m < b.depth_m : a.step > b.step;
    });
  }
}

void AxisRays::AddTriangle(const mesh::TriangleMesh& surface, int64_t triangle) {
  const Eigen::Vector3i corners = surface.triangles.col(triangle);
  const int axis_u = (grid_.axis + 1) % 3, axis_v = (grid_.axis + 2) % 3;
  std::array<Vector2d, 3> corner;  // in steps of the grid
  Eigen::Vector3d depth;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d p = surface.vertices.col(corners[k]).cast<double>();
    corner[k] = (Vector2d(p[axis_u], p[axis_v]) - grid_.first_m) / grid_.spacing_m;
    depth[k] = p[grid_.axis];
  }
  const Vector2d low = corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]);
  const Vector2d high = corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]);
  const auto first = [](double x) { return std::max(0, static_cast<int>(std::ceil(x))); };
  const auto last = [](double x, int count) {
    return std::min(count - 1, static_cast<int>(std::floor(x)));
  };
  for (int v = first(low.y()); v <= last(high.y(), grid_.counts[1]); ++v) {
    for (int u = first(low.x()); u <= last(high.x(), grid_.counts[0]); ++u) {
      Eigen::Vector3d area;
      int num_left = 0;
      for (int k = 0; k < 3; ++k) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        num_left += IsLeft(corners[a], corner[a], corners[b], corner[b], Vector2d(u, v), area[k]);
      }
      if (num_left != 0 && num_left != 3) continue;
      const double total = area.sum();
      const double at = total != 0 ? area.dot(depth) / total : depth.mean();
      const double clamped = std::clamp(at, depth.minCoeff(), depth.maxCoeff());
      // Counter-clockwise seen against the axis: the normal points along it, out of the surface.
      crossings_[static_cast<size_t>(v) * grid_.counts[0] + u].push_back(
          {static_cast<float>(clamped), num_left == 3 ? -1 : 1});
    }
  }
}

int AxisRays::Winding(int u, int v, double depth_m) const {
  int winding = 0;
  for (const Crossing& crossing : Crossings(u, v)) {
    if (crossing.depth_m > depth_m) break;
    winding += crossing.step;
  }
  return winding;
}

InvertedCrossings FindInverted(const mesh::TriangleMesh& surface, const RayGrid& grid) {
  InvertedCrossings result;
  const AxisRays rays(surface, grid);
  for (int v = 0; v < grid.counts[1]; ++v) {
    for (int u = 0; u < grid.counts[0]; ++u) {
      int winding = 0;
      for (const Crossing& crossing : rays.Crossings(u, v)) {
        const int before = winding;
        winding += crossing.step;
        ++result.num_crossings;
        if (std::min(before, winding) >= 0) continue;
        Eigen::Vector3d point;
        point[grid.axis] = crossing.depth_m;
        point[(grid.axis + 1) % 3] = grid.first_m[0] + u * grid.spacing_m;
        point[(grid.axis + 2) % 3] = grid.first_m[1] + v * grid.spacing_m;
        result.inverted.push_back(point.cast<float>());
      }
    }
  }
  return result;
}

}  // namespace liquidblend::registration

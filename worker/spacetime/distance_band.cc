#include "worker/spacetime/distance_band.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace liquidblend::spacetime {
namespace {

constexpr int kNumRings = 3;  // beyond the points next to a triangle: 4 spacings in all
constexpr std::array<std::array<int, 3>, 6> kNeighbors = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

Eigen::Matrix3f CornersOf(const GridSurface& surface, int64_t t) {
  Eigen::Matrix3f corners;
  for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(surface.triangles(c, t));
  return corners;
}

Eigen::Vector3f OffsetFrom(const Eigen::Matrix3f& corners, const Eigen::Vector3f& p) {
  return p - corners * ClosestBarycentric(p, corners.col(0), corners.col(1), corners.col(2));
}

// Zero for a triangle without area.
Eigen::Vector3f UnitNormal(const Eigen::Matrix3f& corners) {
  return (corners.col(1) - corners.col(0))
      .cross(corners.col(2) - corners.col(0))
      .stableNormalized();
}

}  // namespace

// Ericson, Real-Time Collision Detection, section 5.1.5.
Eigen::Vector3f ClosestBarycentric(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                   const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const Eigen::Vector3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Eigen::Vector3f bp = p - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 - d3 > 0) {
    const float v = d1 / (d1 - d3);
    return {1 - v, v, 0};
  }
  const Eigen::Vector3f cp = p - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 - d6 > 0) {
    const float w = d2 / (d2 - d6);
    return {1 - w, 0, w};
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0 && (d4 - d3) + (d5 - d6) > 0) {
    const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const float sum = va + vb + vc;
  if (!(sum > 0)) return {1, 0, 0};  // a triangle without area
  return {va / sum, vb / sum, vc / sum};
}

DistanceBand::DistanceBand(const Grid& grid, const GridSurface& surface, const SlabSteps* wanted) {
  for (int axis = 0; axis < 3; ++axis) block_dims_[axis] = (grid.dims[axis] + 7) / 8;
  block_of_.assign(static_cast<int64_t>(block_dims_[0]) * block_dims_[1] * block_dims_[2], -1);
  std::vector<Point> front = Rasterize(grid, surface, wanted);
  for (int ring = 0; ring < kNumRings; ++ring) front = Grow(grid, surface, wanted, front);
}

DistanceBand::Entry& DistanceBand::FindOrAdd(int i, int j, int k) {
  int32_t& block = block_of_[BlockIndex(i, j, k)];
  if (block < 0) {
    block = static_cast<int32_t>(blocks_.size());
    blocks_.emplace_back();
  }
  return blocks_[block][Slot(i, j, k)];
}

// Exact distances at the grid points within one spacing of a triangle's box.
std::vector<DistanceBand::Point> DistanceBand::Rasterize(const Grid& grid,
                                                         const GridSurface& surface,
                                                         const SlabSteps* wanted) {
  std::vector<Point> added;
  for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
    const Eigen::Matrix3f corners = CornersOf(surface, t);
    Point lo, hi;
    for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = std::max(0, static_cast<int>(std::ceil(corners.row(axis).minCoeff() - 1)));
      hi[axis] = std::min(grid.dims[axis] - 1,
                          static_cast<int>(std::floor(corners.row(axis).maxCoeff() + 1)));
    }
    if (wanted != nullptr && wanted->Most(lo, hi) == 1) continue;
    const Eigen::Vector3f normal = UnitNormal(corners);
    for (int k = lo[2]; k <= hi[2]; ++k) {
      for (int j = lo[1]; j <= hi[1]; ++j) {
        for (int i = lo[0]; i <= hi[0]; ++i) {
          const Eigen::Vector3f p = Eigen::Vector3i(i, j, k).cast<float>();
          Entry& entry = FindOrAdd(i, j, k);
          if (entry.triangle < 0) added.push_back({i, j, k});
          // No point of a triangle is nearer than its plane.
          const float plane_distance = std::abs(normal.dot(p - corners.col(0)));
          if (entry.triangle >= 0 && plane_distance >= entry.distance) continue;
          const Eigen::Vector3f offset = OffsetFrom(corners, p);
          const float distance = offset.norm();
          if (entry.triangle >= 0 && distance >= entry.distance) continue;
          entry = {distance, static_cast<int32_t>(t), offset};
        }
      }
    }
  }
  return added;
}

// Adds the points next to `front`, each with that of its known neighbours' triangles whose closest
// point to the neighbour is nearest.
std::vector<DistanceBand::Point> DistanceBand::Grow(const Grid& grid, const GridSurface& surface,
                                                    const SlabSteps* wanted,
                                                    const std::vector<Point>& front) {
  std::vector<Point> added;
  for (const Point& from : front) {
    const Entry& known = *Find(from[0], from[1], from[2]);
    const int32_t triangle = known.triangle;
    const Eigen::Vector3f offset = known.offset;
    for (const auto& step : kNeighbors) {
      const Point to = {from[0] + step[0], from[1] + step[1], from[2] + step[2]};
      bool outside = false;
      for (int axis = 0; axis < 3; ++axis) {
        outside |= to[axis] < 0 || to[axis] >= grid.dims[axis];
      }
      if (outside || (wanted != nullptr && wanted->OfVoxel(to[0], to[1], to[2]) == 1)) continue;
      Entry& entry = FindOrAdd(to[0], to[1], to[2]);
      if (entry.triangle == triangle) continue;
      const Eigen::Vector3f along = Eigen::Vector3i(step[0], step[1], step[2]).cast<float>();
      const float bound = (offset + along).norm();
      if (entry.triangle >= 0 && bound >= entry.distance) continue;
      if (entry.triangle < 0) added.push_back(to);
      entry = {bound, triangle, offset + along};
    }
  }
  for (const Point& p : added) {
    Entry& entry = FindOrAdd(p[0], p[1], p[2]);
    entry.offset = OffsetFrom(CornersOf(surface, entry.triangle),
                              Eigen::Vector3i(p[0], p[1], p[2]).cast<float>());
    entry.distance = entry.offset.norm();
  }
  return added;
}

}  // namespace liquidblend::spacetime

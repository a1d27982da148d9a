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

// Requires: x > -2^31.
int Ceil(float x) {
  const int truncated = static_cast<int>(x);
  return static_cast<float>(truncated) < x ? truncated + 1 : truncated;
}

// The dot products of a triangle's sides ab and ac with the ways from its corners to a point p.
struct Dots {
  float ab_ap, ac_ap, ab_bp, ac_bp, ab_cp, ac_cp;
};

// Ericson, Real-Time Collision Detection, section 5.1.5.
Eigen::Vector3f ClosestBarycentric(const Dots& d) {
  if (d.ab_ap <= 0 && d.ac_ap <= 0) return {1, 0, 0};
  if (d.ab_bp >= 0 && d.ac_bp <= d.ab_bp) return {0, 1, 0};
  const float vc = d.ab_ap * d.ac_bp - d.ab_bp * d.ac_ap;
  if (vc <= 0 && d.ab_ap >= 0 && d.ab_bp <= 0 && d.ab_ap - d.ab_bp > 0) {
    const float v = d.ab_ap / (d.ab_ap - d.ab_bp);
    return {1 - v, v, 0};
  }
  if (d.ac_cp >= 0 && d.ab_cp <= d.ac_cp) return {0, 0, 1};
  const float vb = d.ab_cp * d.ac_ap - d.ab_ap * d.ac_cp;
  if (vb <= 0 && d.ac_ap >= 0 && d.ac_cp <= 0 && d.ac_ap - d.ac_cp > 0) {
    const float w = d.ac_ap / (d.ac_ap - d.ac_cp);
    return {1 - w, 0, w};
  }
  const float va = d.ab_bp * d.ac_cp - d.ab_cp * d.ac_bp;
  const float to_b = d.ab_cp - d.ac_cp, to_c = d.ac_bp - d.ab_bp;
  if (va <= 0 && to_c >= 0 && to_b >= 0 && to_c + to_b > 0) {
    const float w = to_c / (to_c + to_b);
    return {0, 1 - w, w};
  }
  const float sum = va + vb + vc;
  if (!(sum > 0)) return {1, 0, 0};  // a triangle without area
  return {va / sum, vb / sum, vc / sum};
}

// A triangle and what its distances to many points have in common.
class Near {
 public:
  explicit Near(const Eigen::Matrix3f& corners)
      : a_(corners.col(0)),
        ab_(corners.col(1) - corners.col(0)),
        ac_(corners.col(2) - corners.col(0)),
        normal_(ab_.cross(ac_)),
        ab_ab_(ab_.squaredNorm()),
        ab_ac_(ab_.dot(ac_)),
        ac_ac_(ac_.squaredNorm()),
        normal_sq_(normal_.squaredNorm()) {}

  // Whether its plane is further from p than this; then so are all of its points.
  bool IsPlaneBeyond(const Eigen::Vector3f& p, float distance_sq) const {
    const float scaled = normal_.dot(p - a_);
    return scaled * scaled > distance_sq * normal_sq_;
  }
  // From the closest point to p.
  Eigen::Vector3f Offset(const Eigen::Vector3f& p) const {
    const Eigen::Vector3f ap = p - a_;
    const float ab_ap = ab_.dot(ap), ac_ap = ac_.dot(ap);
    const Eigen::Vector3f w = ClosestBarycentric(
        {ab_ap, ac_ap, ab_ap - ab_ab_, ac_ap - ab_ac_, ab_ap - ab_ac_, ac_ap - ac_ac_});
    return ap - w[1] * ab_ - w[2] * ac_;
  }

 private:
  Eigen::Vector3f a_, ab_, ac_, normal_;
  float ab_ab_, ab_ac_, ac_ac_, normal_sq_;
};

}  // namespace

Eigen::Vector3f ClosestBarycentric(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                   const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const Eigen::Vector3f ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  return ClosestBarycentric(
      {ab.dot(ap), ac.dot(ap), ab.dot(bp), ac.dot(bp), ab.dot(cp), ac.dot(cp)});
}

DistanceBand::DistanceBand(const Grid& grid, const GridSurface& surface, const SlabSteps* wanted) {
  for (int axis = 0; axis < 3; ++axis) block_dims_[axis] = (grid.dims[axis] + 7) / 8;
  block_of_.assign(static_cast<int64_t>(block_dims_[0]) * block_dims_[1] * block_dims_[2], -1);
  std::vector<Point> front = Rasterize(grid, surface, wanted);
  for (int ring = 0; ring < kNumRings; ++ring) front = Grow(grid, surface, wanted, front);
}

const DistanceBand::Entry DistanceBand::kBeyond;

DistanceBand::Corners DistanceBand::AtCorners(int i, int j, int k) const {
  Corners corners;
  if ((i & 7) == 7 || (j & 7) == 7 || (k & 7) == 7) {
    for (int c = 0; c < 8; ++c) corners[c] = &At(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
    return corners;
  }
  const int32_t block = block_of_[BlockIndex(i, j, k)];
  if (block < 0) {
    corners.fill(&kBeyond);
    return corners;
  }
  const Entry* first = &blocks_[block][Slot(i, j, k)];
  for (int c = 0; c < 8; ++c) corners[c] = first + Slot(c & 1, c >> 1 & 1, c >> 2);
  return corners;
}

DistanceBand::Entry& DistanceBand::FindOrAdd(int i, int j, int k) {
  int32_t& block = block_of_[BlockIndex(i, j, k)];
  if (block < 0) {
    block = static_cast<int32_t>(blocks_.size());
    blocks_.emplace_back();
  }
  return blocks_[block][Slot(i, j, k)];
}

// Exact distances at the grid points within one spacing of a triangle's box. They are squared until
// all are known: a point that is not known yet is taken to be two spacings away.
std::vector<DistanceBand::Point> DistanceBand::Rasterize(const Grid& grid,
                                                         const GridSurface& surface,
                                                         const SlabSteps* wanted) {
  std::vector<Point> added;
  for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
    const Eigen::Matrix3f corners = CornersOf(surface, t);
    const Eigen::Array3f least = corners.rowwise().minCoeff(), most = corners.rowwise().maxCoeff();
    Point lo, hi;
    for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = std::max(0, Ceil(least[axis] - 1));
      hi[axis] = std::min(grid.dims[axis] - 1, static_cast<int>(most[axis] + 1));
    }
    if (wanted != nullptr && wanted->Most(lo, hi) == 1) continue;
    const auto sq_beyond = [&](int axis, int at) {
      const auto x = static_cast<float>(at);
      const float beyond = std::max({0.0f, least[axis] - x, x - most[axis]});
      return beyond * beyond;
    };
    const Near triangle(corners);
    for (int k = lo[2]; k <= hi[2]; ++k) {
      const float beyond_z_sq = sq_beyond(2, k);
      for (int j = lo[1]; j <= hi[1]; ++j) {
        const float beyond_yz_sq = beyond_z_sq + sq_beyond(1, j);
        for (int i = lo[0]; i <= hi[0]; ++i) {
          Entry& entry = FindOrAdd(i, j, k);
          const Eigen::Vector3f p(static_cast<float>(i), static_cast<float>(j),
                                  static_cast<float>(k));
          if (beyond_yz_sq + sq_beyond(0, i) >= entry.distance) continue;
          if (triangle.IsPlaneBeyond(p, entry.distance)) continue;
          const Eigen::Vector3f offset = triangle.Offset(p);
          const float distance_sq = offset.squaredNorm();
          if (distance_sq >= entry.distance) continue;
          if (entry.triangle < 0) added.push_back({i, j, k});
          entry = {distance_sq, static_cast<int32_t>(t), offset};
        }
      }
    }
  }
  for (const Point& p : added) {
    Entry& entry = FindOrAdd(p[0], p[1], p[2]);
    entry.distance = std::sqrt(entry.distance);
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
    const Entry& known = At(from[0], from[1], from[2]);
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

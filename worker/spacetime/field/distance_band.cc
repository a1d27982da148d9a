#include "worker/spacetime/field/distance_band.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>

#include "worker/spacetime/field/near_triangle.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kNumRings = 3;  // beyond the points next to a triangle: 4 spacings in all
// Triangles are handed on to what is further away; what is nearer is next to its triangle's box.
constexpr float kExact = 1.0f;
constexpr std::array<std::array<int, 3>, 6> kNeighbors = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

Eigen::Matrix3f CornersOf(const GridSurface& surface, int64_t t) {
  Eigen::Matrix3f corners;
  for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(surface.triangles(c, t));
  return corners;
}

Eigen::Vector3f PointAt(int i, int j, int k) {
  return {static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)};
}

template <typename Visit>
void ForEachPoint(const Grid& grid, const PointBits& points, Visit&& visit) {
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      ForEachBit(points.Row(j, k), grid.words_per_row(), [&](int i) { visit(i, j, k); });
    }
  }
}

PointBits AllPoints(const Grid& grid) {
  PointBits all(grid);
  for (int64_t row = 0; row < grid.num_rows(); ++row) {
    uint64_t* words = all.MutableRow(row);
    for (int i = 0; i < grid.dims[0]; ++i) words[i >> 6] |= uint64_t{1} << (i & 63);
  }
  return all;
}

// Requires: x > -2^31.
int Ceil(float x) {
  const int truncated = static_cast<int>(x);
  return static_cast<float>(truncated) < x ? truncated + 1 : truncated;
}

Eigen::Vector3f OffsetFrom(const Eigen::Matrix3f& corners, const Eigen::Vector3f& p) {
  return p - corners * ClosestBarycentric(p, corners.col(0), corners.col(1), corners.col(2));
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

DistanceBand::DistanceBand(const Grid& grid, const GridSurface& surface, const PointBits* needed)
    : dims_(grid.dims) {
  for (int axis = 0; axis < 3; ++axis) block_dims_[axis] = (dims_[axis] + 7) / 8;
  block_of_.assign(static_cast<int64_t>(block_dims_[0]) * block_dims_[1] * block_dims_[2], -1);
  if (needed != nullptr) {
    Fill(grid, surface, *needed);
  } else {
    Fill(grid, surface, AllPoints(grid));
  }
}

void DistanceBand::Fill(const Grid& grid, const GridSurface& surface, const PointBits& needed) {
  FarPoints far = Rasterize(grid, surface, needed);
  if (!far.unknown.empty()) {
    const FarPoints ways = Rasterize(grid, surface, WaysTo(grid, far.unknown, needed));
    far.known.insert(far.known.end(), ways.known.begin(), ways.known.end());
    far.unknown.insert(far.unknown.end(), ways.unknown.begin(), ways.unknown.end());
  }
  far.known.insert(far.known.end(), far.unknown.begin(), far.unknown.end());
  Grow(surface, std::move(far.known));
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

// Exact distances at the grid points within one spacing of the triangle's box. They are squared
// until those of all triangles are known: a point that is not known yet is taken to be two spacings
// away.
void DistanceBand::Rasterize(const GridSurface& surface, int32_t t, const PointBits& needed) {
  const Eigen::Matrix3f corners = CornersOf(surface, t);
  const Eigen::Array3f least = corners.rowwise().minCoeff(), most = corners.rowwise().maxCoeff();
  Point lo, hi;
  for (int axis = 0; axis < 3; ++axis) {
    lo[axis] = std::max(0, Ceil(least[axis] - 1));
    hi[axis] = std::min(dims_[axis] - 1, static_cast<int>(most[axis] + 1));
  }
  const auto sq_beyond = [&](int axis, int at) {
    const auto x = static_cast<float>(at);
    const float beyond = std::max({0.0f, least[axis] - x, x - most[axis]});
    return beyond * beyond;
  };
  std::optional<NearTriangle> triangle;
  for (int k = lo[2]; k <= hi[2]; ++k) {
    for (int j = lo[1]; j <= hi[1]; ++j) {
      const float sq_beyond_yz = sq_beyond(1, j) + sq_beyond(2, k);
      for (int i = lo[0]; i <= hi[0]; i += 4) {
        const unsigned in_box = hi[0] - i < 3 ? (2u << (hi[0] - i)) - 1 : 15u;
        const unsigned points = static_cast<unsigned>(needed.From(i, j, k)) & in_box;
        std::array<Entry*, 4> entries;
        float furthest_sq = 0;
        for (unsigned rest = points; rest != 0; rest &= rest - 1) {
          const int n = std::countr_zero(rest);
          entries[n] = &EntryAt(i + n, j, k);
          furthest_sq = std::max(furthest_sq, entries[n]->distance);
        }
        if (sq_beyond_yz >= furthest_sq) continue;
        if (!triangle) triangle.emplace(corners);
        const FourOffsets offsets = triangle->OffsetsOfRow(
            static_cast<float>(i), static_cast<float>(j), static_cast<float>(k));
        for (unsigned rest = points; rest != 0; rest &= rest - 1) {
          const int n = std::countr_zero(rest);
          if (offsets.length_sq[n] >= entries[n]->distance) continue;
          *entries[n] = {offsets.length_sq[n], t, {offsets.x[n], offsets.y[n], offsets.z[n]}};
        }
      }
    }
  }
}

// The blocks of these points.
void DistanceBand::AddBlocks(const Grid& grid, const PointBits& points) {
  auto num_blocks = static_cast<int32_t>(blocks_.size());
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      const uint64_t* row = points.Row(j, k);
      for (int i = 0; i < grid.dims[0]; i += 8) {
        if ((row[i >> 6] >> (i & 63) & 0xff) == 0) continue;
        int32_t& block = block_of_[BlockIndex(i, j, k)];
        if (block < 0) block = num_blocks++;
      }
    }
  }
  blocks_.reserve(num_blocks);  // no more: they are large
  blocks_.resize(num_blocks);
}

DistanceBand::FarPoints DistanceBand::Rasterize(const Grid& grid, const GridSurface& surface,
                                                const PointBits& needed) {
  AddBlocks(grid, needed);
  for (int32_t t = 0; t < surface.triangles.cols(); ++t) Rasterize(surface, t, needed);
  FarPoints far;
  ForEachPoint(grid, needed, [&](int i, int j, int k) {
    Entry& entry = EntryAt(i, j, k);
    if (entry.triangle < 0) {
      far.unknown.push_back({i, j, k});
      return;
    }
    entry.distance = std::sqrt(entry.distance);
    if (entry.distance > kExact) far.known.push_back({i, j, k});
  });
  return far;
}

// The points on the way to unknown ones that are not needed themselves.
PointBits DistanceBand::WaysTo(const Grid& grid, const std::vector<Point>& unknown,
                               const PointBits& needed) {
  PointBits ways(grid);
  for (const Point& p : unknown) {
    for (int dk = -kNumRings; dk <= kNumRings; ++dk) {
      const int across = kNumRings - std::abs(dk);
      for (int dj = -across; dj <= across; ++dj) {
        const int along = across - std::abs(dj), j = p[1] + dj, k = p[2] + dk;
        if (j < 0 || j >= grid.dims[1] || k < 0 || k >= grid.dims[2]) continue;
        const int end = std::min(grid.dims[0] - 1, p[0] + along);
        for (int i = std::max(0, p[0] - along); i <= end; ++i) ways.Set(grid, i, j, k);
      }
    }
  }
  for (size_t w = 0; w < needed.words().size(); ++w) ways.words()[w] &= ~needed.words()[w];
  return ways;
}

// Of the points next to p, the triangle whose closest point to its neighbour is nearest to p; -1:
// none is nearer than what p has.
int32_t DistanceBand::TriangleAround(const Point& p) const {
  const Entry& own = At(p[0], p[1], p[2]);
  float nearest_sq =
      own.triangle < 0 ? std::numeric_limits<float>::infinity() : own.distance * own.distance;
  int32_t triangle = -1;
  for (const auto& step : kNeighbors) {
    const Point from = {p[0] - step[0], p[1] - step[1], p[2] - step[2]};
    bool outside = false;
    for (int axis = 0; axis < 3; ++axis) outside |= from[axis] < 0 || from[axis] >= dims_[axis];
    if (outside) continue;
    const Entry& known = At(from[0], from[1], from[2]);
    if (known.triangle < 0 || known.triangle == own.triangle) continue;
    const float sq = (known.offset + PointAt(step[0], step[1], step[2])).squaredNorm();
    if (sq >= nearest_sq) continue;
    nearest_sq = sq;
    triangle = known.triangle;
  }
  return triangle;
}

// Hands triangles on to the points, one step in each ring.
void DistanceBand::Grow(const GridSurface& surface, std::vector<Point> points) {
  std::vector<int32_t> triangles;
  for (int ring = 0; ring < kNumRings && !points.empty(); ++ring) {
    triangles.clear();
    for (const Point& p : points) triangles.push_back(TriangleAround(p));
    size_t num_left = 0;
    for (size_t n = 0; n < points.size(); ++n) {
      const Point& p = points[n];
      if (triangles[n] >= 0) {
        const Eigen::Vector3f offset =
            OffsetFrom(CornersOf(surface, triangles[n]), PointAt(p[0], p[1], p[2]));
        Entry& entry = EntryAt(p[0], p[1], p[2]);
        const float distance = offset.norm();
        if (entry.triangle < 0 || distance < entry.distance) {
          entry = {distance, triangles[n], offset};
        }
      } else if (At(p[0], p[1], p[2]).triangle < 0) {
        points[num_left++] = p;
      }
    }
    points.resize(num_left);
  }
}

}  // namespace liquidblend::spacetime

#include "worker/spacetime/nets/sheet_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "worker/spacetime/field/line_crossings.h"

namespace liquidblend::spacetime {
namespace {

// The two sides of a sheet face away from each other, within 60 degrees.
constexpr float kMaxSheetCosine = -0.5f;
// A sheet's lines are those along the largest component of its normal, or one about as large.
constexpr float kDominant = 0.9f;
constexpr float kMinEndSlope = 0.4f;  // of the triangles at such lines' ends
// Sheets that bend need more points than flat ones.
constexpr float kSlack = 0.25f;
constexpr float kMaxMotion = 1.5f;  // what moves further until the next layer counts as if this far
// No sheet with points of its own is further through along a line.
constexpr double kMaxLength = 5.3;

Eigen::Vector3f AreaNormal(const GridSurface& surface, int64_t t) {
  const Eigen::Vector3f a = surface.vertices.col(surface.triangles(0, t));
  const Eigen::Vector3f ab = surface.vertices.col(surface.triangles(1, t)) - a;
  const Eigen::Vector3f ac = surface.vertices.col(surface.triangles(2, t)) - a;
  return ab.cross(ac);
}

using CrossingsByAxis = std::array<std::vector<Crossing>, 3>;

// In order along each line.
CrossingsByAxis FindCrossings(const Grid& grid, const GridSurface& surface) {
  const std::array<GridLines, 3> lines = {GridLines(grid, 0), GridLines(grid, 1),
                                          GridLines(grid, 2)};
  CrossingsByAxis crossings;
  for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
    const Eigen::Vector3f normal = AreaNormal(surface, t);
    const float least_sq = kMinEndSlope * kMinEndSlope * normal.squaredNorm();
    for (int axis = 0; axis < 3; ++axis) {
      if (!(normal[axis] * normal[axis] > least_sq)) continue;
      CrossLines(surface, t, lines[axis], NthLineShift(0), crossings[axis]);
    }
  }
  for (std::vector<Crossing>& along : crossings) {
    std::sort(along.begin(), along.end(), [](const Crossing& a, const Crossing& b) {
      return std::tie(a.line, a.at, a.triangle) < std::tie(b.line, b.at, b.triangle);
    });
  }
  return crossings;
}

// How far the liquid at a triangle moves along `normal` from layer to layer.
float MotionAlong(const GridSurface& surface, int32_t t, const Eigen::Vector3f& normal,
                  float motion) {
  if (surface.velocities.cols() == 0) return 0;
  float sum = 0;
  for (int c = 0; c < 3; ++c) sum += normal.dot(surface.velocities.col(surface.triangles(c, t)));
  return std::clamp(motion * sum / 3, -kMaxMotion, kMaxMotion);
}

// The part of a line between two crossings.
struct Interval {
  double begin = 0.0, end = -1.0;  // of the points that it needs; none
  float thickness = 0.0f;
};

Interval SheetInterval(const GridSurface& surface, int axis, float motion, const Crossing& in,
                       const Crossing& out) {
  const Eigen::Vector3f before = AreaNormal(surface, in.triangle).stableNormalized();
  const Eigen::Vector3f after = AreaNormal(surface, out.triangle).stableNormalized();
  if (!(before.dot(after) < kMaxSheetCosine)) return {};
  const Eigen::Vector3f normal = (after - before).normalized();
  std::array<float, 4> slope = {std::abs(normal[0]), std::abs(normal[1]), std::abs(normal[2]), 0};
  const float along = slope[axis];
  if (along < kDominant * std::max({slope[0], slope[1], slope[2]})) return {};
  slope[3] = std::abs(0.5f * (MotionAlong(surface, in.triangle, normal, motion) +
                              MotionAlong(surface, out.triangle, normal, motion)));
  std::sort(slope.begin(), slope.end());
  const double half = 0.5 * (slope[2] + slope[3] + kSlack) / along, middle = 0.5 * (in.at + out.at);
  if (out.at - in.at >= 2 * half) return {};
  return {middle - half, middle + half, along * static_cast<float>(out.at - in.at)};
}

bool AtEnd(const Grid& grid, const SheetPoint& p) {
  return p.i < 1 || p.j < 1 || p.k < 1 || p.i + 2 > grid.dims[0] || p.j + 2 > grid.dims[1] ||
         p.k + 2 > grid.dims[2];
}

void AddPointsAlong(const Grid& grid, const GridSurface& surface, int axis, float motion,
                    const std::vector<Crossing>& crossings, std::vector<SheetPoint>& points) {
  const GridLines lines(grid, axis);
  for (size_t n = 0; n + 1 < crossings.size(); ++n) {
    const Crossing &in = crossings[n], &out = crossings[n + 1];
    if (in.line != out.line || in.winding < 0 || out.winding > 0) continue;
    if (out.at - in.at > kMaxLength) continue;
    const Interval interval = SheetInterval(surface, axis, motion, in, out);
    std::array<int, 3> point;
    point[lines.u] = static_cast<int>(in.line % lines.num_u);
    point[lines.v] = static_cast<int>(in.line / lines.num_u);
    const int end = static_cast<int>(std::floor(interval.end));
    for (int a = static_cast<int>(std::ceil(interval.begin)); a <= end; ++a) {
      point[axis] = a;
      const SheetPoint added = {point[0], point[1], point[2], interval.thickness};
      if (!AtEnd(grid, added)) points.push_back(added);
    }
  }
}

// The point `step` along an axis from p.
SheetPoint Next(SheetPoint p, int axis, int step) {
  (axis == 0 ? p.i : axis == 1 ? p.j : p.k) += step;
  return p;
}

void SetInside(const Grid& grid, const SheetPoint& p, InsideBits& inside) {
  inside.MutableRow(grid.Row(p.j, p.k))[p.i >> 6] |= uint64_t{1} << (p.i & 63);
}

bool IsInside(const SheetPoint& p, const InsideBits& inside) { return inside.At(p.i, p.j, p.k); }

}  // namespace

std::vector<SheetPoint> FindSheetPoints(const Grid& grid, const GridSurface& surface,
                                        float motion) {
  const CrossingsByAxis crossings = FindCrossings(grid, surface);
  std::vector<SheetPoint> points;
  for (int axis = 0; axis < 3; ++axis) {
    AddPointsAlong(grid, surface, axis, motion, crossings[axis], points);
  }
  std::stable_sort(points.begin(), points.end(), Precedes);
  const auto same = [](const SheetPoint& a, const SheetPoint& b) { return !Precedes(a, b); };
  points.erase(std::unique(points.begin(), points.end(), same), points.end());
  return points;
}

void AddToInside(const Grid& grid, absl::FunctionRef<float(int, int, int)> distance,
                 std::vector<SheetPoint>& points, InsideBits& inside) {
  for (const SheetPoint& p : points) SetInside(grid, p, inside);
  for (size_t n = 0; n < points.size(); ++n) {  // grows on the way
    for (int face = 0; face < 12; ++face) {
      const int axis = face / 4, other = (axis + 1) % 3;
      const int step = (face & 1) != 0 ? 1 : -1, other_step = (face & 2) != 0 ? 1 : -1;
      const SheetPoint a = Next(points[n], axis, step), b = Next(points[n], other, other_step);
      if (IsInside(a, inside) || IsInside(b, inside)) continue;
      if (!IsInside(Next(a, other, other_step), inside) || AtEnd(grid, a) || AtEnd(grid, b)) {
        continue;
      }
      const float at_a = distance(a.i, a.j, a.k), at_b = distance(b.i, b.j, b.k);
      points.push_back(at_a < at_b || (at_a == at_b && Precedes(a, b)) ? a : b);
      SetInside(grid, points.back(), inside);
    }
  }
  std::sort(points.begin(), points.end(), Precedes);
}

}  // namespace liquidblend::spacetime

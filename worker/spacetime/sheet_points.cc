#include "worker/spacetime/sheet_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "worker/spacetime/line_crossings.h"

namespace liquidblend::spacetime {
namespace {

// The two sides of a sheet face away from each other, within 60 degrees.
constexpr float kOpposed = -0.5f;
// A sheet's lines are those along the largest component of its normal, or one about as large.
constexpr float kDominant = 0.9f;
// So that triangles of either side can have: less is no side of such a sheet.
constexpr float kMinSlope = 0.2f;
// No sheet with points of its own is further through along a grid line.
constexpr double kMaxLength = 2.5;

Eigen::Vector3f AreaNormal(const GridSurface& surface, int64_t t) {
  const Eigen::Vector3f a = surface.vertices.col(surface.triangles(0, t));
  const Eigen::Vector3f ab = surface.vertices.col(surface.triangles(1, t)) - a;
  const Eigen::Vector3f ac = surface.vertices.col(surface.triangles(2, t)) - a;
  return ab.cross(ac);
}

std::vector<Crossing> CrossingsAlong(const GridSurface& surface, const GridLines& lines) {
  std::vector<Crossing> crossings;
  for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
    const Eigen::Vector3f normal = AreaNormal(surface, t);
    if (!(std::abs(normal[lines.axis]) > kMinSlope * normal.norm())) continue;
    CrossLines(surface, t, lines, NthLineShift(0), crossings);
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return std::tie(a.line, a.at, a.triangle) < std::tie(b.line, b.at, b.triangle);
  });
  return crossings;
}

// What is between two crossings of a line.
struct Interval {
  double begin = 0.0, end = -1.0;  // of the points that it needs; none
  float thickness = 0.0f;
};

Interval SheetInterval(const GridSurface& surface, int axis, const Crossing& in,
                       const Crossing& out) {
  const Eigen::Vector3f before = AreaNormal(surface, in.triangle).stableNormalized();
  const Eigen::Vector3f after = AreaNormal(surface, out.triangle).stableNormalized();
  if (!(before.dot(after) < kOpposed)) return {};
  const Eigen::Vector3f normal = (after - before).normalized();
  std::array<float, 3> slope = {std::abs(normal[0]), std::abs(normal[1]), std::abs(normal[2])};
  const float along = slope[axis];
  std::sort(slope.begin(), slope.end());
  if (along < kDominant * slope[2]) return {};
  const double half = 0.5 * (slope[1] + slope[2]) / along, middle = 0.5 * (in.at + out.at);
  if (out.at - in.at >= 2 * half) return {};
  return {middle - half, middle + half, along * static_cast<float>(out.at - in.at)};
}

void AddPointsAlong(const Grid& grid, const GridSurface& surface, int axis,
                    std::vector<SheetPoint>& points) {
  const GridLines lines(grid, axis);
  const std::vector<Crossing> crossings = CrossingsAlong(surface, lines);
  for (size_t n = 0; n + 1 < crossings.size(); ++n) {
    const Crossing &in = crossings[n], &out = crossings[n + 1];
    if (in.line != out.line || in.winding < 0 || out.winding > 0) continue;
    if (out.at - in.at > kMaxLength) continue;
    const Interval interval = SheetInterval(surface, axis, in, out);
    const int end = std::min(grid.dims[axis] - 1, static_cast<int>(std::floor(interval.end)));
    for (int a = std::max(0, static_cast<int>(std::ceil(interval.begin))); a <= end; ++a) {
      std::array<int, 3> point;
      point[axis] = a;
      point[lines.u] = static_cast<int>(in.line % lines.num_u);
      point[lines.v] = static_cast<int>(in.line / lines.num_u);
      points.push_back({point[0], point[1], point[2], interval.thickness});
    }
  }
}

}  // namespace

std::vector<SheetPoint> FindSheetPoints(const Grid& grid, const GridSurface& surface) {
  std::vector<SheetPoint> points;
  for (int axis = 0; axis < 3; ++axis) AddPointsAlong(grid, surface, axis, points);
  std::stable_sort(points.begin(), points.end(), Precedes);
  const auto same = [](const SheetPoint& a, const SheetPoint& b) { return !Precedes(a, b); };
  points.erase(std::unique(points.begin(), points.end(), same), points.end());
  return points;
}

}  // namespace liquidblend::spacetime

#include "worker/registration/surface/axis_rays.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace liquidblend::registration {
namespace {

using Eigen::Vector2d;

constexpr int kMaxRays = 1024;  // along one side of a surface, however large it became

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

struct CrossedRay {
  size_t ray;
  Crossing crossing;
};

// Finds the rays that go through triangles.
class RayFinder {
 public:
  RayFinder(const mesh::TriangleMesh& surface, const RayGrid& grid)
      : surface_(surface), grid_(grid), vertices_(2, surface.num_vertices()) {
    const int axis_u = (grid.axis + 1) % 3, axis_v = (grid.axis + 2) % 3;
    for (int64_t v = 0; v < surface.num_vertices(); ++v) {
      const Eigen::Vector3d p = surface.vertices.col(v).cast<double>();
      vertices_.col(v) = (Vector2d(p[axis_u], p[axis_v]) - grid.first_m) / grid.spacing_m;
    }
  }

  void AddTriangle(int32_t triangle, std::vector<CrossedRay>& found) const {
    const Eigen::Vector3i corners = surface_.triangles.col(triangle);
    const std::array<Vector2d, 3> corner = {vertices_.col(corners[0]), vertices_.col(corners[1]),
                                            vertices_.col(corners[2])};
    const Vector2d low = corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]);
    const Vector2d high = corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]);
    const int first_u = First(low.x()), last_u = Last(high.x(), grid_.counts[0]);
    const int first_v = First(low.y()), last_v = Last(high.y(), grid_.counts[1]);
    for (int v = first_v; v <= last_v; ++v) {
      for (int u = first_u; u <= last_u; ++u) {
        Eigen::Vector3d area;
        int num_left = 0;
        for (int k = 0; k < 3; ++k) {
          const int a = (k + 1) % 3, b = (k + 2) % 3;
          num_left += IsLeft(corners[a], corner[a], corners[b], corner[b], Vector2d(u, v), area[k]);
        }
        if (num_left != 0 && num_left != 3) continue;
        // Counter-clockwise seen against the axis: the normal points along it, out of the surface.
        found.push_back({static_cast<size_t>(v) * grid_.counts[0] + u,
                         {DepthAt(corners, area), num_left == 3 ? -1 : 1, triangle}});
      }
    }
  }

 private:
  static int First(double x) { return std::max(0, static_cast<int>(std::ceil(x))); }
  static int Last(double x, int count) {
    return std::min(count - 1, static_cast<int>(std::floor(x)));
  }
  float DepthAt(const Eigen::Vector3i& corners, const Eigen::Vector3d& area) const {
    Eigen::Vector3d depth;
    for (int k = 0; k < 3; ++k) depth[k] = surface_.vertices(grid_.axis, corners[k]);
    const double total = area.sum();
    const double at = total != 0 ? area.dot(depth) / total : depth.mean();
    return static_cast<float>(std::clamp(at, depth.minCoeff(), depth.maxCoeff()));
  }

  const mesh::TriangleMesh& surface_;
  const RayGrid& grid_;
  Eigen::Matrix2Xd vertices_;  // in steps of the grid
};

}  // namespace

RayGrid RaysThrough(const mesh::TriangleMesh& surface, int axis, double spacing_m, double offset) {
  const Eigen::Vector3d low = surface.vertices.rowwise().minCoeff().cast<double>();
  const Eigen::Vector3d high = surface.vertices.rowwise().maxCoeff().cast<double>();
  RayGrid grid;
  grid.axis = axis;
  grid.spacing_m = std::max(spacing_m, (high - low).maxCoeff() / kMaxRays);
  for (int k = 0; k < 2; ++k) {
    const int across = (axis + 1 + k) % 3;
    grid.first_m[k] = low[across] + offset * grid.spacing_m;
    grid.counts[k] = 1 + static_cast<int>((high[across] - low[across]) / grid.spacing_m);
  }
  return grid;
}

AxisRays::AxisRays(const mesh::TriangleMesh& surface, const RayGrid& grid)
    : grid_(grid), begin_(static_cast<size_t>(grid.counts[0]) * grid.counts[1] + 2, 0) {
  std::vector<CrossedRay> found;
  const RayFinder finder(surface, grid);
  for (int64_t t = 0; t < surface.num_triangles(); ++t) {
    finder.AddTriangle(static_cast<int32_t>(t), found);
  }
  // Counted one further on: writing them moves each ray's begin to its end, the next one's begin.
  for (const CrossedRay& crossed : found) ++begin_[crossed.ray + 2];
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  crossings_.resize(found.size());
  for (const CrossedRay& crossed : found) crossings_[begin_[crossed.ray + 1]++] = crossed.crossing;
  begin_.pop_back();
  for (size_t ray = 0; ray + 1 < begin_.size(); ++ray) {
    std::sort(crossings_.begin() + begin_[ray], crossings_.begin() + begin_[ray + 1],
              [](const Crossing& a, const Crossing& b) {
                return a.depth_m != b.depth_m ? a.depth_m < b.depth_m : a.step > b.step;
              });
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

std::vector<InvertedSpan> FindInvertedSpans(const mesh::TriangleMesh& surface,
                                            const RayGrid& grid) {
  std::vector<InvertedSpan> spans;
  std::vector<Crossing> open;  // left, not entered
  const AxisRays rays(surface, grid);
  for (int v = 0; v < grid.counts[1]; ++v) {
    for (int u = 0; u < grid.counts[0]; ++u) {
      open.clear();
      int winding = 0;
      for (const Crossing& crossing : rays.Crossings(u, v)) {
        const int before = winding;
        winding += crossing.step;
        if (winding < 0 && crossing.step < 0) open.push_back(crossing);
        if (before >= 0 || crossing.step < 0) continue;
        spans.push_back({grid.first_m + grid.spacing_m * Vector2d(u, v), open.back(), crossing});
        open.pop_back();
      }
    }
  }
  return spans;
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

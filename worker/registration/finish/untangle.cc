#include "worker/registration/finish/untangle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/mesh/slice_at.h"
#include "core/mesh/whole_frames.h"
#include "worker/registration/surface/axis_rays.h"
#include "worker/registration/surface/blend_figures.h"

namespace liquidblend::registration {
namespace {

constexpr float kWeights[] = {0.75f, 1.0f, 1.25f};
constexpr int kUntangleRounds = 2;  // the second half a frame around what the first has found, too
constexpr double kOverlap = 0.2;    // edges; how far beyond the other each side is moved
constexpr double kMaxMove = 0.5;    // edges; of a side, at one weight in one round

// Share of one vertex in the move of a side.
struct Push {
  int32_t vertex;
  float share;
  Eigen::Vector3f move;  // edges
};

// One surface to be looked at.
struct Blend {
  const Surface& source;
  Eigen::Matrix4Xf vertices;  // metres and frames
};

// The coordinates of a ray's point in a triangle.
Eigen::Vector3d Barycentric(const mesh::TriangleMesh& surface, int32_t triangle, int axis,
                            const Eigen::Vector2d& at_m) {
  const Eigen::Vector3i corners = surface.triangles.col(triangle);
  std::array<Eigen::Vector2d, 3> from_ray;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d p = surface.vertices.col(corners[k]).cast<double>();
    from_ray[k] = Eigen::Vector2d(p[(axis + 1) % 3], p[(axis + 2) % 3]) - at_m;
  }
  Eigen::Vector3d areas;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d &a = from_ray[(k + 1) % 3], &b = from_ray[(k + 2) % 3];
    areas[k] = a.x() * b.y() - a.y() * b.x();
  }
  const double total = areas.sum();
  return total != 0 ? Eigen::Vector3d(areas / total) : Eigen::Vector3d::Constant(1.0 / 3);
}

// Moves the surface at one of its crossings with a ray outwards, by so much along the ray.
void PushSide(const Blend& blend, const mesh::TracedSlice& slice, double time, int axis,
              const Eigen::Vector2d& at_m, int32_t triangle, double along_ray,
              std::vector<Push>& pushes) {
  const mesh::TriangleMesh& surface = slice.surface;
  const Eigen::Vector3i corners = surface.triangles.col(triangle);
  std::array<Eigen::Vector3d, 3> p;
  for (int k = 0; k < 3; ++k) p[k] = surface.vertices.col(corners[k]).cast<double>();
  const Eigen::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  const double distance = std::min(kMaxMove, along_ray * std::abs(normal[axis]) + kOverlap);
  const Eigen::Vector3f move = (distance * normal).cast<float>();
  const Eigen::Vector3d at = Barycentric(surface, triangle, axis, at_m);
  for (int k = 0; k < 3; ++k) {
    const auto [a, b] = slice.edges[corners[k]];
    const double begin = blend.vertices(3, a), end = blend.vertices(3, b);
    const double share = (time - begin) / (end - begin);
    pushes.push_back({a, static_cast<float>(at[k] * (1 - share)), move});
    pushes.push_back({b, static_cast<float>(at[k] * share), move});
  }
}

// Finds the moves of all inverted sides in a slice. Returns the number of inverted spans of rays.
int64_t FindPushes(const Blend& blend, const mesh::TracedSlice& slice, double time,
                   std::vector<Push>& pushes) {
  if (slice.surface.num_triangles() == 0) return 0;
  const double edge_m = blend.source.mesh.edge_length_m;
  int64_t num_spans = 0;
  for (const int axis : {0, 2}) {
    const RayGrid grid = RaysThrough(slice.surface, axis, kRaySpacing * edge_m, kRayOffset);
    for (const InvertedSpan& span : FindInvertedSpans(slice.surface, grid)) {
      const double half = 0.5 * (span.enters.depth_m - span.leaves.depth_m) / edge_m;
      for (const Crossing& crossing : {span.leaves, span.enters}) {
        PushSide(blend, slice, time, axis, span.at_m, crossing.triangle, half, pushes);
      }
      ++num_spans;
    }
  }
  return num_spans;
}

// Each vertex by the mean of its pushes.
void Apply(std::vector<Push>& pushes, const Surface& source, float weight, Points& displacement) {
  std::stable_sort(pushes.begin(), pushes.end(),
                   [](const Push& a, const Push& b) { return a.vertex < b.vertex; });
  for (size_t n = 0; n < pushes.size();) {
    const int32_t v = pushes[n].vertex;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float total = 0;
    for (; n < pushes.size() && pushes[n].vertex == v; ++n) {
      sum += pushes[n].share * pushes[n].move;
      total += pushes[n].share;
    }
    if (total > 0 && !source.rigid[v]) displacement.col(v).head<3>() += sum / (total * weight);
  }
}

// One weight at some times, of which those where something is inside out are marked.
int64_t UntangleAt(const Surface& source, const Points& extrapolation, float weight,
                   const std::vector<double>& times, const parallel::Arena& arena,
                   Points& displacement, std::vector<char>& is_tangled) {
  const float within = std::min(weight, 1.0f);
  const Blend blend{
      source, BlendAt(source, within * displacement + (weight - within) * extrapolation, 1.0f)};
  std::vector<std::vector<Push>> of_slice(times.size());
  std::vector<int64_t> num_spans(times.size());
  mesh::VisitSlices(source.mesh, blend.vertices, times, arena,
                    [&](int64_t n, const mesh::TracedSlice& slice) {
                      num_spans[n] = FindPushes(blend, slice, times[n], of_slice[n]);
                    });
  std::vector<Push> pushes;
  int64_t total = 0;
  for (size_t n = 0; n < times.size(); ++n) {
    pushes.insert(pushes.end(), of_slice[n].begin(), of_slice[n].end());
    if (num_spans[n] > 0) is_tangled[n] = 1;
    total += num_spans[n];
  }
  Apply(pushes, source, within, displacement);
  return total;
}

// The marked times, and half a frame before and after each.
std::vector<double> TimesAround(const std::vector<double>& times, const std::vector<char>& marked,
                                double last) {
  std::vector<double> around;
  for (size_t n = 0; n < times.size(); ++n) {
    if (marked[n] == 0) continue;
    for (const double time : {times[n] - 0.5, times[n], times[n] + 0.5}) {
      const bool is_new = around.empty() || time > around.back();
      if (is_new && time >= 0 && time <= last) around.push_back(time);
    }
  }
  return around;
}

}  // namespace

int64_t Untangle(const Surface& source, const Points& extrapolation, const parallel::Arena& arena,
                 Points& displacement) {
  std::vector<double> times = mesh::WholeFrames(source.mesh);
  int64_t num_left = 0;
  for (int round = 0; round < kUntangleRounds && !times.empty(); ++round) {
    num_left = 0;
    std::vector<char> is_tangled(times.size(), 0);
    for (const float weight : kWeights) {
      num_left += UntangleAt(source, extrapolation, weight, times, arena, displacement, is_tangled);
    }
    times = TimesAround(times, is_tangled, source.mesh.num_frames - 1);
  }
  return num_left;
}

}  // namespace liquidblend::registration

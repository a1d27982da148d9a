#include "worker/registration/surface/blend_figures.h"

#include <algorithm>
#include <cmath>

#include "core/mesh/slice_at.h"
#include "core/mesh/time_axis.h"
#include "worker/registration/surface/axis_rays.h"

namespace liquidblend::registration {
namespace {

constexpr int kNumTimes = 12;
constexpr double kSmallestPart = 1e-3;  // of the liquid; less is a speck

double NumParts(const mesh::TriangleMesh& slice) {
  const std::vector<double> volumes = mesh::ComponentVolumes(slice);
  double total = 0;
  for (const double volume : volumes) total += std::abs(volume);
  return static_cast<double>(std::count_if(volumes.begin(), volumes.end(), [&](double volume) {
    return std::abs(volume) > kSmallestPart * total;
  }));
}

InvertedCrossings CountInverted(const mesh::TriangleMesh& surface, double spacing_m) {
  InvertedCrossings all;
  if (surface.num_triangles() == 0) return all;
  for (const int axis : {0, 2}) {
    const auto found = FindInverted(surface, RaysThrough(surface, axis, spacing_m, kRayOffset));
    all.num_crossings += found.num_crossings;
    all.inverted.insert(all.inverted.end(), found.inverted.begin(), found.inverted.end());
  }
  return all;
}

// Blends times as families do: the pre-roll is compressed.
void BlendTimes(const Surface& source, const Points& displacement, float weight,
                Eigen::Matrix4Xf& vertices) {
  const mesh::SpaceTimeMesh& mesh = source.mesh;
  const mesh::TimeAxis axis({}, mesh.frames_per_second, mesh.num_frames, mesh.num_pre_roll);
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    const double from = axis.Ticks(mesh.vertices(3, v));
    const double to = axis.Ticks(static_cast<double>(mesh.vertices(3, v)) + displacement(3, v));
    vertices(3, v) = static_cast<float>(from + weight * (to - from));
  }
}

}  // namespace

Eigen::Matrix4Xf BlendAt(const Surface& source, const Points& displacement, float weight) {
  Eigen::Matrix4Xf vertices = displacement * weight;
  vertices.topRows<3>() *= static_cast<float>(source.mesh.edge_length_m);
  vertices += source.mesh.vertices;
  if (source.mesh.num_pre_roll > 0) BlendTimes(source, displacement, weight, vertices);
  const int64_t num_first = source.mesh.num_first_vertices;
  const int64_t num_last = source.mesh.num_last_vertices;
  constexpr float kOutside = 1e-3f;
  const float last = static_cast<float>(source.mesh.num_frames - 1) + kOutside;
  vertices.row(3).leftCols(num_first) = vertices.row(3).leftCols(num_first).cwiseMin(-kOutside);
  vertices.row(3).rightCols(num_last) = vertices.row(3).rightCols(num_last).cwiseMax(last);
  return vertices;
}

std::vector<std::vector<mesh::Component>> ComponentsAt(const mesh::SpaceTimeMesh& mesh,
                                                       const Eigen::Matrix4Xf& vertices_m,
                                                       std::span<const double> times,
                                                       const parallel::Arena& arena) {
  std::vector<std::vector<mesh::Component>> components(times.size());
  mesh::VisitSlices(mesh, vertices_m, times, arena, [&](int64_t n, const mesh::TracedSlice& slice) {
    components[n] = mesh::FindComponents(slice.surface);
  });
  return components;
}

std::vector<double> SliceTimes(const mesh::SpaceTimeMesh& mesh) {
  std::vector<double> times;
  for (int n = 0; n < kNumTimes; ++n) {
    times.push_back(n * (mesh.num_frames - 1.0) / (kNumTimes - 1.0));
  }
  return times;
}

std::vector<mesh::TriangleMesh> SliceBlend(const Surface& source, const Points& displacement,
                                           float weight, const parallel::Arena& arena) {
  return mesh::SliceAt(source.mesh, BlendAt(source, displacement, weight), SliceTimes(source.mesh),
                       arena);
}

std::vector<mesh::TriangleMesh> SliceTarget(const mesh::SpaceTimeMesh& source,
                                            const mesh::SpaceTimeMesh& target,
                                            const parallel::Arena& arena) {
  std::vector<double> times = SliceTimes(source);
  for (double& time : times) time = std::min(time, target.num_frames - 1.0);
  return mesh::SliceAt(target, times, arena);
}

std::vector<double> VolumeErrors(const std::vector<mesh::TriangleMesh>& source,
                                 const std::vector<mesh::TriangleMesh>& target,
                                 const std::vector<mesh::TriangleMesh>& half_way) {
  std::vector<double> means;
  for (size_t n = 0; n < source.size(); ++n) {
    means.push_back(0.5 * (mesh::Volume(source[n]) + mesh::Volume(target[n])));
  }
  const double smallest = kSmallestPart * *std::max_element(means.begin(), means.end());
  std::vector<double> errors;
  for (size_t n = 0; n < source.size(); ++n) {
    const double mean = std::max(means[n], smallest);
    errors.push_back(mean > 0 ? (mesh::Volume(half_way[n]) - means[n]) / mean : 0.0);
  }
  return errors;
}

double ComponentError(const std::vector<mesh::TriangleMesh>& a,
                      const std::vector<mesh::TriangleMesh>& b) {
  double sum = 0;
  for (size_t n = 0; n < a.size(); ++n) sum += std::abs(NumParts(a[n]) - NumParts(b[n]));
  return sum / static_cast<double>(std::max<size_t>(1, a.size()));
}

double ComponentErrorBetween(const std::vector<mesh::TriangleMesh>& source,
                             const std::vector<mesh::TriangleMesh>& target,
                             const std::vector<mesh::TriangleMesh>& blend,
                             const std::vector<int>& more) {
  double sum = 0;
  for (size_t n = 0; n < blend.size(); ++n) {
    const double a = NumParts(source[n]), b = NumParts(target[n]), count = NumParts(blend[n]);
    sum += std::max({0.0, std::min(a, b) - count, count - std::max(a, b) - more[n]});
  }
  return sum / static_cast<double>(std::max<size_t>(1, blend.size()));
}

double InvertedShare(const std::vector<mesh::TriangleMesh>& slices, const mesh::SpaceTimeMesh& mesh,
                     const parallel::Arena& arena, Regions& regions) {
  std::vector<InvertedCrossings> counts(slices.size());
  arena.Run(static_cast<int64_t>(slices.size()), [&](int64_t n) {
    counts[n] = CountInverted(slices[n], kRaySpacing * mesh.edge_length_m);
  });
  int64_t num_crossings = 0, num_inverted = 0;
  const std::vector<double> times = SliceTimes(mesh);
  for (size_t n = 0; n < counts.size(); ++n) {
    num_crossings += counts[n].num_crossings;
    num_inverted += static_cast<int64_t>(counts[n].inverted.size());
    for (const Eigen::Vector3f& point : counts[n].inverted) {
      Eigen::Vector4f position;
      position << point / static_cast<float>(mesh.edge_length_m), static_cast<float>(times[n]);
      regions.Add(position, 1.0);
    }
  }
  return static_cast<double>(num_inverted) /
         static_cast<double>(std::max<int64_t>(1, num_crossings));
}

}  // namespace liquidblend::registration

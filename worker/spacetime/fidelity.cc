#include "worker/spacetime/fidelity.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <vector>

#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "core/mesh/slice_at.h"
#include "worker/spacetime/field/triangle_tree.h"

namespace liquidblend::spacetime {
namespace {

// Chooses frames that the mesh can show, evenly spread, the first and the last among them.
std::vector<int> ChooseFrames(const mesh::Animation& animation, int num_shown, int max_frames) {
  const int first = animation.num_pre_roll;
  int count = 0;
  while (first + count < animation.num_frames() && animation.time(first + count) <= num_shown - 1) {
    ++count;
  }
  const int wanted = std::min(count, max_frames);
  std::vector<int> frames;
  for (int64_t n = 0; n < wanted; ++n) {
    frames.push_back(first + (wanted == 1 ? 0 : static_cast<int>(n * (count - 1) / (wanted - 1))));
  }
  return frames;
}

struct Distances {
  double mean = 0.0, max = 0.0;  // metres
};

Distances DistancesTo(const TriangleTree& tree, const mesh::TriangleMesh& from, int max_points) {
  const int64_t count = from.num_vertices();
  const int64_t step = (count + max_points - 1) / max_points;
  Distances distances;
  int64_t num_points = 0;
  for (int64_t v = 0; v < count; v += step, ++num_points) {
    const double distance = tree.Distance(from.vertices.col(v));
    distances.mean += distance;
    distances.max = std::max(distances.max, distance);
  }
  distances.mean /= static_cast<double>(num_points);
  return distances;
}

struct FrameFidelity {
  std::optional<Distances> distances;  // none: one of the two surfaces is empty
  double volume_error = 0.0;
  int64_t num_components = 0, num_components_shown = 0;
};

FrameFidelity Compare(const mesh::TriangleMesh& frame, const mesh::TriangleMesh& slice,
                      int max_points) {
  FrameFidelity result;
  result.num_components = mesh::NumComponents(frame);
  result.num_components_shown = mesh::NumComponents(slice);
  const double volume_m3 = mesh::Volume(frame), shown_m3 = mesh::Volume(slice);
  const double larger_m3 = std::max(std::abs(volume_m3), std::abs(shown_m3));
  if (larger_m3 > 0) result.volume_error = std::abs(volume_m3 - shown_m3) / larger_m3;
  const TriangleTree frame_tree(frame), slice_tree(slice);
  if (frame_tree.empty() || slice_tree.empty()) return result;
  const Distances there = DistancesTo(slice_tree, frame, max_points);
  const Distances back = DistancesTo(frame_tree, slice, max_points);
  result.distances = {0.5 * (there.mean + back.mean), std::max(there.max, back.max)};
  return result;
}

mesh::Fidelity Summarize(const std::vector<FrameFidelity>& frames, double edge_length_m) {
  mesh::Fidelity fidelity;
  fidelity.num_frames = static_cast<int>(frames.size());
  int num_compared = 0;
  for (const FrameFidelity& frame : frames) {
    fidelity.max_volume_error = std::max(fidelity.max_volume_error, frame.volume_error);
    fidelity.num_components += frame.num_components;
    fidelity.num_components_shown += frame.num_components_shown;
    fidelity.max_component_error = std::max(
        fidelity.max_component_error, std::abs(frame.num_components_shown - frame.num_components));
    if (!frame.distances) continue;
    ++num_compared;
    fidelity.mean_distance_edges += frame.distances->mean / edge_length_m;
    fidelity.max_distance_edges =
        std::max(fidelity.max_distance_edges, frame.distances->max / edge_length_m);
  }
  fidelity.mean_distance_edges /= std::max(1, num_compared);
  return fidelity;
}

}  // namespace

absl::Status FidelityOptions::Validate() const {
  LB_RETURN_IF_ERROR(mesh::CheckRange("max_frames", max_frames, {1, 10'000}));
  return mesh::CheckRange("max_points", max_points, {1, 1'000'000});
}

mesh::Fidelity MeasureFidelity(const mesh::Animation& animation, const mesh::SpaceTimeMesh& mesh,
                               const FidelityOptions& options, const parallel::Arena& arena) {
  assert(options.Validate().ok());
  const std::vector<int> chosen = ChooseFrames(animation, mesh.num_frames, options.max_frames);
  std::vector<double> times;
  for (const int k : chosen) times.push_back(animation.time(k));
  const std::vector<mesh::TriangleMesh> slices = mesh::SliceAt(mesh, times, arena);
  std::vector<FrameFidelity> frames(chosen.size());
  arena.Run(static_cast<int64_t>(chosen.size()), [&](int64_t n) {
    frames[n] = Compare(animation.frames[chosen[n]], slices[n], options.max_points);
  });
  return Summarize(frames, mesh.edge_length_m);
}

}  // namespace liquidblend::spacetime

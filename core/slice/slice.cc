#include "core/slice/slice.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace liquidblend::slice {
namespace {

// Margin for rounding of a blended time beyond its bounds; if it is too small, the surface may be
// open.
constexpr float kTimeMargin = 1e-3F;          // ticks ...
constexpr float kRelativeTimeMargin = 1e-6F;  // ... and per tick of the time
// Times are given in seconds; a product this close to a frame means the frame.
constexpr double kFrameSnap = 1e-6;  // frames

// Rounded as the vertices' ticks are, so that a vertex of a frame is not earlier than it.
double TicksOf(const mesh::TimeAxis& axis, double frames) {
  return axis.counts_frames() ? frames : static_cast<float>(axis.Ticks(frames));
}

double FramesOf(const mesh::RegisteredFamily& family, double time_s) {
  const double frames = std::clamp(time_s * family.frames_per_second, 0.0,
                                   static_cast<double>(family.num_frames - 1));
  const double nearest = std::round(frames);
  return std::abs(frames - nearest) < kFrameSnap ? nearest : frames;
}

// Adds factor * [ranges.min, ranges.max] to the intervals of `count` entries from `begin` on.
void AddScaled(float factor, const TimeRanges& ranges, size_t begin, size_t count, float* earliest,
               float* latest) {
  const float* low = (factor > 0.0F ? ranges.min : ranges.max).data() + begin;
  const float* high = (factor > 0.0F ? ranges.max : ranges.min).data() + begin;
  for (size_t i = 0; i < count; ++i) earliest[i] += factor * low[i];
  for (size_t i = 0; i < count; ++i) latest[i] += factor * high[i];
}

// Calls cross(i) for each i in [begin, begin + count), clusters or groups of them, whose times may
// be those of the slice, in order.
template <typename Cross>
void ForCrossing(std::span<const TimeRanges> times, size_t begin, size_t count,
                 const Workspace& workspace, float* earliest, float* latest, Cross&& cross) {
  const auto time = static_cast<float>(workspace.time_ticks);
  const float margin = kTimeMargin + kRelativeTimeMargin * time;
  std::copy_n(times[0].min.begin() + begin, count, earliest);
  std::copy_n(times[0].max.begin() + begin, count, latest);
  for (const TimeTerm& term : workspace.terms) {
    AddScaled(term.factor, times[term.field], begin, count, earliest, latest);
  }
  for (size_t i = 0; i < count; ++i) {
    // Written so that a bound that overflowed to NaN excludes nothing.
    const bool is_after = earliest[i] > time + margin;
    const bool is_before = latest[i] < time - margin;
    if (!is_after && !is_before) cross(begin + i);
  }
}

}  // namespace

absl::Status FindCandidates(const CellIndex& index, std::span<const double> weights, double time_s,
                            Workspace& workspace) {
  const mesh::RegisteredFamily& family = index.family();
  assert(weights.size() == family.targets.size());
  if (!(time_s >= 0.0 && time_s <= family.duration_s())) {  // NaN too
    return absl::OutOfRangeError(absl::StrCat("time ", time_s, " s is not in [0, ",
                                              family.duration_s(), "] s of family ", family.name));
  }
  workspace.time_ticks = TicksOf(family.time_axis(), FramesOf(family, time_s));
  workspace.terms.clear();
  index.AppendTerms(weights, workspace.terms);
  workspace.clusters.clear();
  const auto num_clusters = static_cast<size_t>(index.num_clusters());
  const size_t num_groups = index.group_times()[0].min.size();
  workspace.earliest.resize(num_groups);
  workspace.latest.resize(num_groups);
  std::array<float, kClustersPerGroup> earliest;
  std::array<float, kClustersPerGroup> latest;
  const auto add_cluster = [&](size_t c) { workspace.clusters.push_back(static_cast<int32_t>(c)); };
  const auto search_group = [&](size_t group) {
    const size_t begin = group * kClustersPerGroup;
    const size_t count = std::min<size_t>(kClustersPerGroup, num_clusters - begin);
    ForCrossing(index.cluster_times(), begin, count, workspace, earliest.data(), latest.data(),
                add_cluster);
  };
  ForCrossing(index.group_times(), 0, num_groups, workspace, workspace.earliest.data(),
              workspace.latest.data(), search_group);
  return absl::OkStatus();
}

}  // namespace liquidblend::slice

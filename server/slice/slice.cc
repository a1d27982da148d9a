#include "server/slice/slice.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace liquidblend::slice {
namespace {

// What rounding may add to a blended time beyond its bounds; too little opens the surface.
constexpr float kTimeMargin = 1e-3F;          // frames ...
constexpr float kRelativeTimeMargin = 1e-6F;  // ... and per frame of the time
// Times are given in seconds; a product this close to a frame means the frame.
constexpr double kFrameSnap = 1e-6;  // frames

double FramesOf(const mesh::RegisteredFamily& family, double time_s) {
  const double frames = std::clamp(time_s * family.frames_per_second, 0.0,
                                   static_cast<double>(family.num_frames - 1));
  const double nearest = std::round(frames);
  return std::abs(frames - nearest) < kFrameSnap ? nearest : frames;
}

// Adds factor * [ranges.min, ranges.max] to each cluster's interval.
void AddScaled(float factor, const TimeRanges& ranges, Workspace& workspace) {
  if (factor == 0.0F) return;
  const auto& low = factor > 0.0F ? ranges.min : ranges.max;
  const auto& high = factor > 0.0F ? ranges.max : ranges.min;
  for (size_t c = 0; c < low.size(); ++c) workspace.earliest[c] += factor * low[c];
  for (size_t c = 0; c < high.size(); ++c) workspace.latest[c] += factor * high[c];
}

void BoundTimes(const CellIndex& index, std::span<const double> weights, Workspace& workspace) {
  workspace.earliest = index.source_time().min;
  workspace.latest = index.source_time().max;
  for (int k = 0; k < static_cast<int>(weights.size()); ++k) {
    const mesh::TargetMotion motion = mesh::MotionAt(index.family().targets[k], weights[k]);
    AddScaled(motion.displacement_factor, index.target_time(k).displacement, workspace);
    AddScaled(motion.extrapolation_factor, index.target_time(k).extrapolation, workspace);
  }
}

// Written so that a bound that overflowed to NaN excludes nothing.
void ChooseClusters(const CellIndex& index, Workspace& workspace) {
  const auto time = static_cast<float>(workspace.time_frames);
  const float margin = kTimeMargin + kRelativeTimeMargin * time;
  workspace.clusters.clear();
  workspace.is_block_needed.assign(index.num_blocks(), 0);
  for (int32_t c = 0; c < index.num_clusters(); ++c) {
    const bool is_after = workspace.earliest[c] > time + margin;
    const bool is_before = workspace.latest[c] < time - margin;
    if (is_after || is_before) continue;
    workspace.clusters.push_back(c);
    for (const int32_t block : index.blocks(c)) workspace.is_block_needed[block] = 1;
  }
}

void PlaceBlocks(const CellIndex& index, Workspace& workspace) {
  const auto num_vertices = static_cast<int32_t>(index.family().vertices.size());
  workspace.vertex_ranges.clear();
  workspace.num_vertices = 0;
  workspace.block_offset.resize(index.num_blocks());
  for (int32_t block = 0; block < index.num_blocks(); ++block) {
    if (!workspace.is_block_needed[block]) continue;
    const int32_t begin = block * kVerticesPerBlock;
    const int32_t end = begin + std::min(kVerticesPerBlock, num_vertices - begin);
    workspace.block_offset[block] = static_cast<int32_t>(workspace.num_vertices);
    workspace.num_vertices += end - begin;
    auto& ranges = workspace.vertex_ranges;
    if (!ranges.empty() && ranges.back()[1] == begin) {
      ranges.back()[1] = end;
    } else {
      ranges.push_back({begin, end});
    }
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
  workspace.time_frames = FramesOf(family, time_s);
  BoundTimes(index, weights, workspace);
  ChooseClusters(index, workspace);
  PlaceBlocks(index, workspace);
  return absl::OkStatus();
}

}  // namespace liquidblend::slice

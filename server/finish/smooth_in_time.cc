#include "server/finish/smooth_in_time.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace liquidblend::finish {
namespace {

using mesh::Float4;

constexpr int32_t kVerticesPerBlock = 64;

// Finds a vertex of the family among the wide positions.
class WidePositions {
 public:
  WidePositions(std::span<const Float4> positions, const TemporalWorkspace& workspace)
      : positions_(positions.data()), block_offset_(workspace.block_offset.data()) {}
  const Float4& operator[](int32_t v) const {
    return positions_[block_offset_[v / kVerticesPerBlock] + v % kVerticesPerBlock];
  }

 private:
  const Float4* positions_;
  const int32_t* block_offset_;
};

// Adds to `at` its share of the way to the line from `before` to `after`.
void MoveTowardsLine(const Float4& before, const Float4& after, const TemporalOptions& options,
                     Float4& at) {
  if (!(before[3] < at[3] && at[3] < after[3])) return;
  const float s = (at[3] - before[3]) / (after[3] - before[3]);
  Float4 offset = {};
  float length_sq = 0.0F;
  for (int k = 0; k < 3; ++k) {
    const float on_line = before[k] + s * (after[k] - before[k]);
    offset[k] = 0.5F * static_cast<float>(options.strength) * (on_line - at[k]);
    length_sq += offset[k] * offset[k];
  }
  const float length = std::sqrt(length_sq);
  const auto limit = static_cast<float>(options.max_offset_m);
  const float share = length > limit ? limit / length : 1.0F;
  for (int k = 0; k < 3; ++k) at[k] += share * offset[k];
}

}  // namespace

absl::Status TemporalOptions::Validate() const {
  if (!(strength >= 0.0 && strength <= 1.0)) {
    return absl::InvalidArgumentError(absl::StrCat("strength is ", strength, ", not in [0, 1]"));
  }
  if (!(max_offset_m >= 0.0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_offset_m is ", max_offset_m, ", not at least 0"));
  }
  return absl::OkStatus();
}

void FindTimeNeighbors(const TimeLinks& links, std::span<const mesh::VertexRange> ranges,
                       TemporalWorkspace& workspace) {
  const auto num_vertices = static_cast<int32_t>(links.earlier().size());
  const int32_t num_blocks = (num_vertices + kVerticesPerBlock - 1) / kVerticesPerBlock;
  workspace.is_block_needed.assign(num_blocks, 0);
  const auto need = [&](int32_t v) {
    if (v >= 0) workspace.is_block_needed[v / kVerticesPerBlock] = 1;
  };
  for (const mesh::VertexRange& range : ranges) {
    for (int32_t v = range[0]; v < range[1]; ++v) {
      need(v);
      need(links.earlier()[v]);
      need(links.later()[v]);
    }
  }
  workspace.vertex_ranges.clear();
  workspace.block_offset.resize(num_blocks);
  int32_t offset = 0;
  for (int32_t block = 0; block < num_blocks; ++block) {
    if (!workspace.is_block_needed[block]) continue;
    const int32_t begin = block * kVerticesPerBlock;
    const int32_t end = std::min(num_vertices, begin + kVerticesPerBlock);
    workspace.block_offset[block] = offset;
    offset += end - begin;
    auto& wide = workspace.vertex_ranges;
    if (!wide.empty() && wide.back()[1] == begin) {
      wide.back()[1] = end;
    } else {
      wide.push_back({begin, end});
    }
  }
}

void SmoothInTime(const TimeLinks& links, std::span<const Float4> wide_positions,
                  std::span<const mesh::VertexRange> ranges, const TemporalOptions& options,
                  const TemporalWorkspace& workspace, std::vector<Float4>& positions) {
  assert(options.Validate().ok());
  const WidePositions wide(wide_positions, workspace);
  size_t num_vertices = 0;
  for (const mesh::VertexRange& range : ranges) num_vertices += range[1] - range[0];
  if (positions.size() < num_vertices) positions.resize(num_vertices);
  Float4* out = positions.data();
  for (const mesh::VertexRange& range : ranges) {
    for (int32_t v = range[0]; v < range[1]; ++v, ++out) {
      *out = wide[v];
      const int32_t before = links.earlier()[v];
      const int32_t after = links.later()[v];
      if (before >= 0 && after >= 0) MoveTowardsLine(wide[before], wide[after], options, *out);
    }
  }
}

}  // namespace liquidblend::finish

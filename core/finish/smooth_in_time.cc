#include "core/finish/smooth_in_time.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace liquidblend::finish {
namespace {

using mesh::Float4;

// Moves `at` towards the line from `before` to `after`.
void MoveTowardsLine(const Float4& before, const Float4& after, const mesh::TimeAxis& axis,
                     const TemporalOptions& options, Float4& at) {
  if (!(before[3] < at[3] && at[3] < after[3])) return;
  const double from = axis.Frames(before[3]);
  const auto s = static_cast<float>((axis.Frames(at[3]) - from) / (axis.Frames(after[3]) - from));
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

void TimeSmoother::PlaceNeighbors(std::span<const int32_t> vertices, std::span<const int32_t> links,
                                  std::vector<Float4>& positions) const {
  auto& neighbors = workspace_.neighbors;
  neighbors.clear();
  // A vertex without a link is its own neighbour, which is neither before nor after it.
  for (const int32_t v : vertices) neighbors.push_back(links[v] >= 0 ? links[v] : v);
  if (positions.size() < neighbors.size()) positions.resize(neighbors.size());
  placer_.Place(neighbors, positions.data());
}

void TimeSmoother::Place(std::span<const int32_t> vertices, Float4* positions) const {
  placer_.Place(vertices, positions);
  PlaceNeighbors(vertices, links_.earlier(), workspace_.before);
  PlaceNeighbors(vertices, links_.later(), workspace_.after);
  for (size_t i = 0; i < vertices.size(); ++i) {
    MoveTowardsLine(workspace_.before[i], workspace_.after[i], links_.axis(), options_,
                    positions[i]);
  }
}

}  // namespace liquidblend::finish

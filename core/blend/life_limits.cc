#include "core/blend/life_limits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace liquidblend::blend {
namespace {

// Parts of the source whose centres are nearer than this in all coordinates are the same.
constexpr double kSamePartEdges = 1.0;
constexpr double kRoundingTicks = 1e-9;  // clamped weights stay as they are

bool IsSamePart(const std::array<float, 3>& a, const std::array<float, 3>& b, double distance_m) {
  return std::equal(a.begin(), a.end(), b.begin(),
                    [&](float x, float y) { return std::abs(x - y) <= distance_m; });
}

// The nearest blend of the inputs, by clamping and scaling.
std::vector<double> AmongInputs(std::vector<double> weights) {
  for (double& weight : weights) weight = std::max(weight, 0.0);
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  if (sum > 1) {
    for (double& weight : weights) weight /= sum;
  }
  return weights;
}

}  // namespace

double LifeLimits::Limit::EndAt(const std::vector<double>& weights) const {
  return std::inner_product(weights.begin(), weights.end(), growth.begin(), source_end);
}

LifeLimits::LifeLimits(const mesh::RegisteredFamily& family) {
  const mesh::TimeAxis axis = family.time_axis();
  const size_t num_targets = family.targets.size();
  std::vector<std::array<float, 3>> starts;
  for (size_t k = 0; k < num_targets; ++k) {
    for (const mesh::PartLife& life : family.targets[k].report.part_lives) {
      const auto known = std::find_if(starts.begin(), starts.end(), [&](const auto& start) {
        return IsSamePart(start, life.source_start_m, kSamePartEdges * family.edge_length_m);
      });
      const auto i = static_cast<size_t>(known - starts.begin());
      if (known == starts.end()) {
        starts.push_back(life.source_start_m);
        limits_.push_back({axis.Ticks(life.source_end_frames), std::vector<double>(num_targets),
                           axis.Ticks(std::min(kMinPartLifeFrames, life.source_end_frames))});
      }
      Limit& limit = limits_[i];
      const double target_end = axis.Ticks(life.target_end_frames);
      limit.growth[k] = target_end - limit.source_end;
      limit.min_end = std::min(limit.min_end, target_end);
    }
  }
}

bool LifeLimits::Clamp(std::vector<double>& weights) const {
  std::vector<double> inputs;
  double share = 1.0;  // of the way from there to the weights
  for (const Limit& limit : limits_) {
    const double end = limit.EndAt(weights);
    if (end >= limit.min_end - kRoundingTicks) continue;
    if (inputs.empty()) inputs = AmongInputs(weights);
    const double inner_end = limit.EndAt(inputs);
    share = std::min(share, (inner_end - limit.min_end) / (inner_end - end));
  }
  if (share == 1.0) return false;
  for (size_t k = 0; k < weights.size(); ++k) {
    weights[k] = inputs[k] + std::max(share, 0.0) * (weights[k] - inputs[k]);
  }
  return true;
}

}  // namespace liquidblend::blend

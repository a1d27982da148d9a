#include "client/cli/print/stream_stats.h"

#include <algorithm>
#include <cmath>

namespace liquidblend::cli {

Percentiles ComputePercentiles(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });  // NaN has no order
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    return values[std::max<size_t>(static_cast<size_t>(rank), 1) - 1];
  };
  return {at(0.5), at(0.95), at(0.99), values.back()};
}

void StreamStats::AddFrame(const StreamedFrame& frame, absl::Time arrival) {
  if (arrivals_s_.empty()) first_ = arrival;
  arrivals_s_.push_back(absl::ToDoubleSeconds(arrival - first_));
  const double number =
      static_cast<double>(frame.frame_index) + static_cast<double>(frame.num_dropped);
  due_s_.push_back(number / frames_per_second_);
  num_bytes_ += static_cast<int64_t>(frame.frame.data.size());
  num_dropped_ = frame.num_dropped;
  const auto level = static_cast<size_t>(std::clamp(frame.level_of_detail, 0, kMaxLevels - 1));
  if (level >= frames_by_level_.size()) frames_by_level_.resize(level + 1);
  ++frames_by_level_[level];
}

double StreamStats::seconds() const { return arrivals_s_.empty() ? 0.0 : arrivals_s_.back(); }

double StreamStats::FramesPerSecond() const {
  return seconds() > 0.0 ? static_cast<double>(num_frames() - 1) / seconds() : 0.0;
}

Percentiles StreamStats::IntervalsMs() const {
  std::vector<double> intervals;
  for (size_t i = 1; i < arrivals_s_.size(); ++i) {
    intervals.push_back(1e3 * (arrivals_s_[i] - arrivals_s_[i - 1]));
  }
  return ComputePercentiles(std::move(intervals));
}

Percentiles StreamStats::LatenessMs() const {
  std::vector<double> late;
  for (size_t i = 0; i < arrivals_s_.size(); ++i)
    late.push_back(1e3 * (arrivals_s_[i] - due_s_[i]));
  if (late.empty()) return {};
  const double earliest = *std::min_element(late.begin(), late.end());
  for (double& value : late) value -= earliest;
  return ComputePercentiles(std::move(late));
}

}  // namespace liquidblend::cli

// Statistics of a stream: how well it keeps its pace.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/time/time.h"
#include "liquidblend/frame_stream.h"

namespace liquidblend::cli {

struct Percentiles {
  double p50 = 0.0;
  double p95 = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};

// Nearest-rank percentiles of the values that are finite; all 0 without any.
Percentiles ComputePercentiles(std::vector<double> values);

// Threads: one.
class StreamStats {
 public:
  static constexpr int kMaxLevels = 16;

  // `frames_per_second`: the requested rate, > 0.
  explicit StreamStats(double frames_per_second) : frames_per_second_(frames_per_second) {}

  // Any numbers of `frame` are safe: they are the server's.
  void AddFrame(const StreamedFrame& frame, absl::Time arrival);

  // The time from a change of weights to the first frame that shows it.
  void AddReaction(absl::Duration time) { reactions_ms_.push_back(ToMs(time)); }

  int64_t num_frames() const { return static_cast<int64_t>(arrivals_s_.size()); }
  int64_t num_bytes() const { return num_bytes_; }
  int64_t num_dropped() const { return num_dropped_; }
  // By level of detail, up to the coarsest one that came; those below 0 count as 0, those above the
  // last as it.
  const std::vector<int64_t>& frames_by_level() const { return frames_by_level_; }
  double seconds() const;           // from the first frame to the last
  double FramesPerSecond() const;   // as they came
  Percentiles IntervalsMs() const;  // between frames
  Percentiles LatenessMs() const;   // behind the pace set by the most punctual frame
  Percentiles ReactionsMs() const { return ComputePercentiles(reactions_ms_); }

 private:
  static double ToMs(absl::Duration time) { return absl::ToDoubleMilliseconds(time); }

  double frames_per_second_;
  int64_t num_bytes_ = 0;
  int64_t num_dropped_ = 0;
  std::vector<int64_t> frames_by_level_;
  absl::Time first_;
  std::vector<double> arrivals_s_;  // since the first frame
  std::vector<double> due_s_;       // likewise, at an even pace, dropped frames counted
  std::vector<double> reactions_ms_;
};

}  // namespace liquidblend::cli

#include "server/frames/frame_pacer.h"

#include <algorithm>
#include <cmath>

namespace liquidblend::server {
namespace {

// Tolerance of the end, as a share of a step: a tick this far past the end is still on it, so that
// rounding does not lose the last frame.
constexpr double kEndTolerance = 1e-6;

// Largest number of ticks. Whole numbers up to this are exact as double. At any pace it takes 285
// years to get there.
constexpr double kMaxTicks = 9e15;

double InRange(double value, double min, double max, double if_nan) {
  return std::isnan(value) ? if_nan : std::clamp(value, min, max);
}

// The pace within the ranges of the header, with which every product and quotient below is finite.
Pace Bounded(const Pace& pace) {
  const Pace defaults;
  Pace bounded = pace;
  bounded.duration_s = InRange(pace.duration_s, 0.0, 1e15, defaults.duration_s);
  bounded.frames_per_second =
      InRange(pace.frames_per_second, 1e-6, 1e6, defaults.frames_per_second);
  bounded.rate = InRange(pace.rate, -1e9, 1e9, defaults.rate);
  return bounded;
}

}  // namespace

// Starts the new pace at the next tick, when that is due by the old one, so that changes do not
// stutter; but never later than the new pace's own period.
void FramePacer::Change(const Pace& pace, std::optional<double> time_s, absl::Duration now) {
  const double start_time_s = time_s.has_value() ? *time_s : TimeOf(next_tick_);
  const absl::Duration due = pace_.lossless ? now : DueOf(next_tick_);
  pace_ = Bounded(pace);
  start_ = std::clamp(due, now, now + absl::Seconds(1) / pace_.frames_per_second);
  start_time_s_ = InRange(start_time_s, 0.0, pace_.duration_s, 0.0);
  next_tick_ = 0;
}

std::optional<FramePacer::Tick> FramePacer::Next(absl::Duration now) {
  const std::optional<int64_t> last = LastTick();
  if (last.has_value() && next_tick_ > *last) return std::nullopt;
  const absl::Duration period = absl::Seconds(1) / pace_.frames_per_second;
  const absl::Duration late = now - DueOf(next_tick_);
  if (!pace_.lossless && late > period) {
    // Skips to the newest tick that is due; at the end to the last one, so that the end is always
    // shown.
    const double num_late = std::min(absl::FDivDuration(late, period), kMaxTicks);
    int64_t newest = next_tick_ + static_cast<int64_t>(num_late);
    if (last.has_value()) newest = std::min(newest, *last);
    num_skipped_ += newest - next_tick_;
    next_tick_ = newest;
  }
  Tick tick;
  tick.due = pace_.lossless ? now : DueOf(next_tick_);
  tick.time_s = TimeOf(next_tick_);
  return tick;
}

std::optional<double> FramePacer::NextTime() const {
  const std::optional<int64_t> last = LastTick();
  if (last.has_value() && next_tick_ > *last) return std::nullopt;
  return TimeOf(next_tick_);
}

absl::Duration FramePacer::DueOf(int64_t tick) const {
  return start_ + absl::Seconds(static_cast<double>(tick) / pace_.frames_per_second);
}

// The time that a tick shows. A round of a loop takes one step more than the animation, so that
// both its last and its first frame are shown.
double FramePacer::TimeOf(int64_t tick) const {
  const double step_s = std::abs(pace_.rate) / pace_.frames_per_second;
  const double tolerance_s = kEndTolerance * step_s;
  double time_s = start_time_s_ + static_cast<double>(tick) * pace_.rate / pace_.frames_per_second;
  const bool is_inside = time_s >= -tolerance_s && time_s <= pace_.duration_s + tolerance_s;
  if (pace_.loop && !is_inside) {
    const double round_s = pace_.duration_s + step_s;
    time_s -= std::floor((time_s + tolerance_s) / round_s) * round_s;
  }
  return InRange(time_s, 0.0, pace_.duration_s, 0.0);  // NaN: a round that takes no time
}

std::optional<int64_t> FramePacer::LastTick() const {
  if (pace_.loop || pace_.rate == 0) return std::nullopt;
  const double way_s = pace_.rate > 0 ? pace_.duration_s - start_time_s_ : start_time_s_;
  const double num_steps = way_s / std::abs(pace_.rate) * pace_.frames_per_second;
  if (num_steps > kMaxTicks) return std::nullopt;
  return static_cast<int64_t>(std::floor(num_steps + kEndTolerance));
}

}  // namespace liquidblend::server

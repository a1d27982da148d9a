#include "core/mesh/time_axis.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace liquidblend::mesh {
namespace {

constexpr double kPreRollTicks = 1e-3;  // of all its frames together

}  // namespace

TimeAxis::TimeAxis(const std::optional<double>& rest_time_s, double frames_per_second,
                   int num_frames, int num_pre_roll)
    : squares_(rest_time_s.has_value() && num_frames > 1), last_(num_frames - 1) {
  if (num_pre_roll > 0) pre_roll_ = num_pre_roll;
  if (squares_) since_rest_ = -2.0 * *rest_time_s * frames_per_second;
}

// (t + c)^2 - c^2 for t frames since the first and c from rest to there, scaled.
double TimeAxis::Ticks(double frames) const {
  if (frames <= 0.0) return TicksBefore(frames);
  if (!squares_ || frames == last_) return frames;
  const double ticks = frames * (frames + since_rest_) / (last_ + since_rest_);
  return frames <= last_ ? std::min(ticks, last_) : std::max(ticks, last_);
}

double TimeAxis::Frames(double ticks) const {
  if (ticks <= 0.0) return FramesBefore(ticks);
  if (!squares_ || ticks == last_) return ticks;
  const double half = 0.5 * since_rest_;
  // The same as sqrt(product + half^2) - half, without cancellation.
  const double product = ticks * (last_ + since_rest_);
  const double frames = product / (std::sqrt(product + half * half) + half);
  return ticks <= last_ ? std::min(frames, last_) : std::max(frames, last_);
}

// Before the pre-roll ticks are as long as frames.
double TimeAxis::TicksBefore(double frames) const {
  if (!(pre_roll_ > 0)) return frames;
  if (frames >= -pre_roll_) return frames * kPreRollTicks / pre_roll_;
  return frames + pre_roll_ - kPreRollTicks;
}

double TimeAxis::FramesBefore(double ticks) const {
  if (!(pre_roll_ > 0)) return ticks;
  if (ticks >= -kPreRollTicks) return ticks * pre_roll_ / kPreRollTicks;
  return ticks - pre_roll_ + kPreRollTicks;
}

void TimeAxis::ToTicks(Eigen::Matrix4Xf& vertices) const {
  if (counts_frames()) return;
  for (float& t : vertices.row(3)) t = static_cast<float>(Ticks(t));
}

void TimeAxis::ToFrames(Eigen::Matrix4Xf& vertices) const {
  if (counts_frames()) return;
  for (float& t : vertices.row(3)) t = static_cast<float>(Frames(t));
}

void TimeAxis::ToTicks(const Eigen::Matrix4Xf& vertices, Eigen::Matrix4Xf& displacement) const {
  assert(displacement.cols() == 0 || displacement.cols() == vertices.cols());
  if (counts_frames()) return;
  for (Eigen::Index v = 0; v < displacement.cols(); ++v) {
    const double from = vertices(3, v);
    displacement(3, v) = static_cast<float>(Ticks(from + displacement(3, v)) - Ticks(from));
  }
}

void TimeAxis::ToFrames(const Eigen::Matrix4Xf& vertices, Eigen::Matrix4Xf& displacement) const {
  assert(displacement.cols() == 0 || displacement.cols() == vertices.cols());
  if (counts_frames()) return;
  for (Eigen::Index v = 0; v < displacement.cols(); ++v) {
    const double from = vertices(3, v);
    displacement(3, v) = static_cast<float>(Frames(Ticks(from) + displacement(3, v)) - from);
  }
}

}  // namespace liquidblend::mesh

// Time axis of a family: the unit of its vertices' fourth coordinate.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace liquidblend::mesh {

// The map between frames and ticks. A blend mixes coordinates linearly: positions, and times in
// ticks.
//
// Without a rest time ticks are frames, as in the paper (equation 8). With one they are squares of
// the time since then: a body that falls from rest by h lands after sqrt(2 h / g), so where heights
// blend linearly, squares of times do (Froude's similarity: lengths scale as squares of times). A
// drop from half-way between two heights then falls with the same g as both; blended linearly in
// time it would land too early, by d^2 / (2 t) if both land d from their mean t.
//
// Ticks are scaled so that the first frame is at 0 and the last one at num_frames - 1, both ways.
// Times before the first frame stay as they are. But the frames of a pre-roll together are a
// thousandth of a tick long, so that its last moment hardly shifts the mean of times.
// Threads: safe, immutable.
class TimeAxis {
 public:
  TimeAxis() = default;  // ticks are frames
  // The axis of a family with this rest time, or without one. Requires: num_frames >= 1,
  // frames_per_second > 0; the rest time, if there is one, is in kRestTimeS (option_ranges.h).
  TimeAxis(const std::optional<double>& rest_time_s, double frames_per_second, int num_frames,
           int num_pre_roll = 0);

  bool counts_frames() const { return !squares_ && pre_roll_ == 0.0; }
  // The ticks of a time in frames, and the frames of a time in ticks. Both maps are increasing, and
  // the inverse of one another up to rounding. Requires: finite.
  double Ticks(double frames) const;
  double Frames(double ticks) const;

  // Convert the times of positions, columns of x, y, z, t, from frames to ticks and back.
  void ToTicks(Eigen::Matrix4Xf& vertices) const;
  void ToFrames(Eigen::Matrix4Xf& vertices) const;
  // Convert the times of displacements of `vertices`, which are in frames. Requires: as many
  // columns as vertices, or none.
  void ToTicks(const Eigen::Matrix4Xf& vertices, Eigen::Matrix4Xf& displacement) const;
  void ToFrames(const Eigen::Matrix4Xf& vertices, Eigen::Matrix4Xf& displacement) const;

 private:
  double TicksBefore(double frames) const;
  double FramesBefore(double ticks) const;

  bool squares_ = false;
  double pre_roll_ = 0.0;    // frames
  double since_rest_ = 0.0;  // twice the frames from rest to the first frame
  double last_ = 0.0;        // frame
};

}  // namespace liquidblend::mesh

// Timeline of a player: the program's clock -> the animation's time, and the blend at that time.
#pragma once

#include <cmath>

#include "client/player/frame_source.h"

namespace liquidblend::player {

// Map from the program's clock (seconds, any origin, never back) to the time of the animation. It
// is linear between two changes.  Threads: none.
class Timeline {
 public:
  // An animation whose duration is not positive and finite has one moment, 0.
  explicit Timeline(double duration_s)
      : duration_s_(duration_s > 0.0 && std::isfinite(duration_s) ? duration_s : 0.0) {}

  // The clock begins: changes before were at `now`.
  void Start(double now) { anchor_now_ = now; }
  // Changes from `now` on. Time goes on from where it is.
  void SetRate(double rate, double now);  // seconds of the animation per second; may be negative
  void SetPlaying(bool playing, double now);
  void SetLoop(bool loop, double now);
  void Seek(double time_s, double now);  // clamped to [0, duration_s]; NaN: nothing changes

  // In [0, duration_s]: without a loop it stays at the end that it has come to.
  double TimeAt(double now) const;
  // Seconds of the animation per second; 0 while paused, or at an end.
  double SpeedAt(double now) const;
  bool is_playing() const { return playing_; }

 private:
  void Anchor(double now);
  double Speed() const { return playing_ ? rate_ : 0.0; }

  const double duration_s_;
  double anchor_now_ = 0.0;
  double anchor_time_s_ = 0.0;
  double rate_ = 1.0;
  bool playing_ = false;
  bool loop_ = false;
};

// Blend that changes linearly from one to another.  Threads: none.
class BlendCourse {
 public:
  // The clock begins: the last change was at `now`.
  void Start(double now) { start_ = now; }
  // From `now` on, over so many seconds: from what it is then. Between weights and parameters, or
  // other parameters, it changes at once.
  void Change(const BlendSpec& to, double over_s, double now);
  BlendSpec At(double now) const;
  // Whether it does not change any more.
  bool IsSettledAt(double now) const { return now >= start_ + over_s_; }
  const BlendSpec& target() const { return to_; }

 private:
  BlendSpec from_, to_;
  double start_ = 0.0;
  double over_s_ = 0.0;
};

}  // namespace liquidblend::player

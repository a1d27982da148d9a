// Pacer of a stream: the times of the animation to show, and when they are due. Knows no clock and
// no gRPC.
#pragma once

#include <cstdint>
#include <optional>

#include "absl/time/time.h"

namespace liquidblend::server {

// Pace of a stream. Numbers outside of the ranges given here are moved to the nearest end; a NaN
// counts as the default.
struct Pace {
  double duration_s = 0.0;          // [0, 1e15]; of the animation
  double frames_per_second = 24.0;  // [1e-6, 1e6]; of the clock
  double rate = 1.0;                // [-1e9, 1e9]; seconds of the animation per second of the clock
  bool loop = false;                // else the frames end where the animation ends
  bool lossless = false;            // every frame is due at once, and none is skipped
};

// Pacer that gives ticks at a steady rate. A tick is skipped if it is late by more than one period
// when it is asked for, so the next tick is always the newest one. Any numbers are safe: families
// of older stores may have been imported with any frame rate.  Threads: one at a time.
class FramePacer {
 public:
  struct Tick {
    absl::Duration due;
    double time_s = 0.0;  // in [0, duration_s]
  };

  // Changes the pace, starting from time_s if it is set, else from the time that is shown at `now`.
  // now: finite, on any clock that only goes forward; the same one for all calls.
  void Change(const Pace& pace, std::optional<double> time_s, absl::Duration now);

  // The next tick; nothing when the animation has ended. The same one again until Advance(), unless
  // it has become late by then. Requires: Change() was called.
  std::optional<Tick> Next(absl::Duration now);
  // The time that the next tick shows, late or not; nothing at the end.
  std::optional<double> NextTime() const;
  // Goes on to the next tick.
  void Advance() { ++next_tick_; }

  int64_t num_skipped() const { return num_skipped_; }

 private:
  absl::Duration DueOf(int64_t tick) const;
  double TimeOf(int64_t tick) const;
  std::optional<int64_t> LastTick() const;  // inside the animation; nothing: it never ends

  Pace pace_;
  absl::Duration start_;       // when tick 0 is due
  double start_time_s_ = 0.0;  // what tick 0 shows
  int64_t next_tick_ = 0;
  int64_t num_skipped_ = 0;
};

}  // namespace liquidblend::server

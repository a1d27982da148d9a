// Schedule of a player's frames: which to get next, and which is due.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "client/player/frame_pool.h"
#include "client/player/frame_source.h"
#include "client/player/timeline.h"

namespace liquidblend::player {

// Options of a schedule.
struct ScheduleOptions {
  double frames_per_second = 60.0;  // > 0; frames are made for these moments of the program's clock
  double look_ahead_s = 0.5;        // >= 0; how early frames are got
};

// Counts since the start.
struct ScheduleCounts {
  int64_t num_shown = 0;   // frames that became due and were there
  int64_t num_missed = 0;  // moments that passed without a frame while it played
  int64_t num_stale = 0;   // of the shown: with weights from before a change
};

// The program's clock is cut into moments, frames_per_second of them a second. A moment's frame is
// got before it is due. While the blend changes again and again, only frames that can still be in
// time are got, and those with the blend of before are shown meanwhile. Threads: one at a time.
class Schedule {
 public:
  // A frame to get.
  struct Job {
    int64_t moment = 0;
    int64_t number = 0;  // of jobs, in their order
    FrameSpec spec;
  };

  Schedule(double duration_s, const ScheduleOptions& options)
      : options_(options), timeline_(duration_s), changed_(kLongAgo) {}

  // The frame's surface, format and bits from now on; the blend and the time are not used.
  void SetForm(const FrameSpec& form) { form_ = form; }
  // The blend that is asked for already changes nothing, unless it is to come at once.
  void SetBlend(const BlendSpec& blend, double over_s, double now);
  Timeline& timeline() { return timeline_; }
  const Timeline& timeline() const { return timeline_; }
  double now() const { return now_; }
  BlendSpec blend() const { return course_.target(); }
  bool is_still() const { return timeline_.SpeedAt(now_) == 0.0; }  // time does not go on

  // Sets the program's clock, which begins at the first call and never goes back. Returns the
  // newest frame that is due, the same as before if there is no newer one; null: none was there
  // yet.
  FramePtr Advance(double now);

  // The next frame to get, which counts as on its way from now on; nothing: all are there or on
  // their way.
  //   latency_s  how long it takes to get a frame
  std::optional<Job> Next(double latency_s);
  // Ends a job: with its frame, or null if it has failed.
  void Deliver(const Job& job, FramePtr frame);

  const ScheduleCounts& counts() const { return counts_; }

 private:
  static constexpr double kLongAgo = -1e15;

  struct Shown {
    FramePtr frame;
    FrameSpec spec;
    int64_t number = -1;  // of the job
  };
  struct Slot {
    std::optional<Job> on_its_way;
    Shown ready;
  };

  double ClockAt(int64_t moment) const {
    return static_cast<double>(moment) / options_.frames_per_second;
  }
  FrameSpec SpecAt(double clock) const;
  void Start(double now);
  bool IsMet(int64_t moment, Slot& slot, const FrameSpec& wanted);
  bool ReuseOther(Slot& slot, const FrameSpec& wanted);
  int64_t LastMoment(int64_t first, double latency_s) const;
  void ShowDue(int64_t moment);
  void ShowStill();
  int64_t CountMissed(int64_t moment) const;

  const ScheduleOptions options_;
  Timeline timeline_;
  BlendCourse course_;
  FrameSpec form_;
  double now_ = 0.0;
  bool has_clock_ = false;  // Advance() was called
  double changed_;          // when the blend was changed last
  std::map<int64_t, Slot> slots_;
  std::optional<int64_t> shown_moment_;  // nothing: time stood still
  Shown shown_;
  int64_t num_jobs_ = 0;
  ScheduleCounts counts_;
};

}  // namespace liquidblend::player

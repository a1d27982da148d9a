// Player of a family's frames for a loop that must not wait.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "client/player/allocator.h"
#include "client/player/detail_control.h"
#include "client/player/frame_pool.h"
#include "client/player/frame_source.h"
#include "client/player/schedule.h"

namespace liquidblend::player {

// Way of frames to the player.
enum class Transport {
  kAutomatic,  // meshoptimizer's codecs; Draco where the network is too slow for them
  kMeshopt,
  kDraco,
};

struct PlayerOptions {
  ScheduleOptions schedule;
  int num_threads = 4;     // [1, 64]; that get and decode frames
  SurfaceOptions surface;  // of every frame; its level of detail is the finest that is shown
  bool adapts_detail = true;
  Transport transport = Transport::kAutomatic;
  int position_bits = 0;  // [8, 16]; 0: 14
  Allocator allocator;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// What Player::Poll() returns.
struct PolledFrame {
  FramePtr frame;  // null: none was there yet
  // Factor of velocities: seconds of the animation per second, 0 while it stands still.
  double velocity_scale = 0.0;
  absl::Status error;  // of the newest failure; OK since a frame has come
};

struct PlayerStatistics {
  ScheduleCounts counts;
  int64_t num_received = 0;  // frames that were got
  int64_t num_bytes = 0;     // received
  double wait_s = 0.0;       // sums over the frames that were got: for the server ...
  double decode_s = 0.0;     // ... and decoding or making them
  double latency_s = 0.0;    // from asking for a frame to having it, at present
  int level_of_detail = 0;   // at present
  FrameFormat format = FrameFormat::kMeshopt;
  absl::Status last_error;  // as PolledFrame::error
};

// Threads: one thread calls Poll() and what changes the course; WaitExact(), statistics() and the
// facts from any.
class Player {
 public:
  static constexpr double kLongestClock_s = 1e12;

  // Starts the threads.  Requires: options.Validate().ok().
  Player(std::unique_ptr<FrameSource> source, const PlayerOptions& options);
  // Waits for what is on its way, at most the source's longest call.
  ~Player();
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  const FamilyFacts& facts() const { return source_->facts(); }

  // The course, from the last Poll() on. These may wait for another thread, microseconds.
  void SetBlend(const BlendSpec& blend, double over_s);
  void SetPlaying(bool playing);
  void SetRate(double rate);  // finite; negative: backwards
  void SetLoop(bool loop);
  void Seek(double time_s);

  // Sets the program's clock and returns the newest frame that is due. Never waits: while another
  // thread holds the schedule, the frame is that of the last call.
  //   now  seconds from any origin, never back, in [-kLongestClock_s, kLongestClock_s]
  // Cost: microseconds.
  PolledFrame Poll(double now);

  // The frame of exactly this time and the blend that was set last, at the options' level of detail
  // and not a moment before it is there. Tries again while the server cannot be reached.
  // Errors: kDeadlineExceeded after patience_s; those of the source that waiting does not cure.
  absl::StatusOr<FramePtr> WaitExact(double time_s, double patience_s);

  PlayerStatistics statistics() const;

 private:
  using SteadyClock = std::chrono::steady_clock;

  void Work(const std::stop_token& stop);
  std::optional<Schedule::Job> WaitForJob(const std::stop_token& stop);
  void WaitForChange() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Get(const FrameSpec& spec, std::shared_ptr<FrameMesh>& frame, FrameCost& cost);
  void Finish(const Schedule::Job& job, const absl::Status& status, FramePtr frame,
              const FrameCost& cost);
  FrameSpec FormAt(int level, FrameFormat format) const;
  void PollLocked(double now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void OnChange() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void SignalIfIdle() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::unique_ptr<FrameSource> source_;
  const PlayerOptions options_;
  const std::shared_ptr<FramePool> pool_;

  mutable absl::Mutex mutex_;
  absl::CondVar changed_;
  Schedule schedule_ ABSL_GUARDED_BY(mutex_);
  DetailControl control_ ABSL_GUARDED_BY(mutex_);
  PlayerStatistics statistics_ ABSL_GUARDED_BY(mutex_);
  SteadyClock::time_point retry_at_ ABSL_GUARDED_BY(mutex_);  // after a failure
  absl::Duration back_off_ ABSL_GUARDED_BY(mutex_);
  int num_idle_ ABSL_GUARDED_BY(mutex_) = 0;
  bool is_one_watching_ ABSL_GUARDED_BY(mutex_) = false;  // an idle thread that looks by itself

  PolledFrame polled_;  // of the thread that polls
  std::vector<std::jthread> threads_;
};

}  // namespace liquidblend::player

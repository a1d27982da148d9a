#include "client/player/player.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"

namespace liquidblend::player {
namespace {

constexpr int kMaxThreads = 64;
constexpr double kMaxFramesPerSecond = 1000.0, kMaxLookAhead_s = 60.0;
constexpr double kFirstLatency_s = 0.05;
constexpr double kLatencyShare = 0.1;  // of the newest frame, in the running mean
constexpr double kLatencyStep_s = 0.005;
constexpr absl::Duration kStillPatience = absl::Milliseconds(20);
constexpr absl::Duration kFirstBackOff = absl::Milliseconds(50), kLongestBackOff = absl::Seconds(1);

absl::Status OutOfRange(const char* option, double value, double low, double high) {
  return absl::InvalidArgumentError(
      absl::StrCat(option, " is ", value, ", not in [", low, ", ", high, "]"));
}

// Whether the next attempt may succeed.
bool IsWorthRetrying(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) ||
         absl::IsResourceExhausted(status) || absl::IsAborted(status);
}

DetailOptions DetailOf(const PlayerOptions& options, int num_levels) {
  DetailOptions detail;
  detail.finest = options.surface.level_of_detail;
  detail.coarsest = options.adapts_detail ? std::max(detail.finest, num_levels - 1) : detail.finest;
  detail.may_change_format = options.transport == Transport::kAutomatic;
  detail.num_threads = options.num_threads;
  return detail;
}

}  // namespace

absl::Status PlayerOptions::Validate() const {
  const double fps = schedule.frames_per_second;
  if (!(fps > 0.0 && fps <= kMaxFramesPerSecond)) {
    return absl::InvalidArgumentError(
        absl::StrCat("frames_per_second is ", fps, ", not in (0, ", kMaxFramesPerSecond, "]"));
  }
  if (!(schedule.look_ahead_s >= 0.0 && schedule.look_ahead_s <= kMaxLookAhead_s)) {
    return OutOfRange("look_ahead_s", schedule.look_ahead_s, 0, kMaxLookAhead_s);
  }
  if (num_threads < 1 || num_threads > kMaxThreads) {
    return OutOfRange("num_threads", num_threads, 1, kMaxThreads);
  }
  if (position_bits != 0 && (position_bits < 8 || position_bits > 16)) {
    return OutOfRange("position_bits", position_bits, 8, 16);
  }
  return absl::OkStatus();
}

Player::Player(std::unique_ptr<FrameSource> source, const PlayerOptions& options)
    : source_(std::move(source)),
      options_(options),
      pool_(std::make_shared<FramePool>(options.allocator)),
      schedule_(source_->facts().duration_s, options.schedule),
      control_(DetailOf(options, source_->facts().num_levels)),
      back_off_(kFirstBackOff) {
  {
    const absl::MutexLock lock(&mutex_);
    statistics_.latency_s = kFirstLatency_s;
    statistics_.level_of_detail = control_.level();
    statistics_.format =
        options.transport == Transport::kDraco ? FrameFormat::kDraco : FrameFormat::kMeshopt;
    schedule_.SetForm(FormAt(control_.level(), statistics_.format));
    BlendSpec source_only;
    source_only.weights.resize(source_->facts().targets.size(), 0.0);
    schedule_.SetBlend(source_only, 0.0, -kMaxLookAhead_s);
  }
  for (int k = 0; k < options.num_threads; ++k) {
    threads_.emplace_back([this](const std::stop_token& stop) { Work(stop); });
  }
}

Player::~Player() {
  for (std::jthread& thread : threads_) thread.request_stop();
  {
    const absl::MutexLock lock(&mutex_);
    changed_.SignalAll();
  }
  threads_.clear();
}

FrameSpec Player::FormAt(int level, FrameFormat format) const {
  FrameSpec form;
  form.surface = options_.surface;
  form.surface.level_of_detail = level;
  form.position_bits = options_.position_bits;
  form.format = format;
  return form;
}

void Player::SetBlend(const BlendSpec& blend, double over_s) {
  const absl::MutexLock lock(&mutex_);
  schedule_.SetBlend(blend, over_s, schedule_.now());
  SignalIfIdle();
}

void Player::SetPlaying(bool playing) {
  const absl::MutexLock lock(&mutex_);
  schedule_.timeline().SetPlaying(playing, schedule_.now());
  SignalIfIdle();
}

void Player::SetRate(double rate) {
  const absl::MutexLock lock(&mutex_);
  schedule_.timeline().SetRate(rate, schedule_.now());
  SignalIfIdle();
}

void Player::SetLoop(bool loop) {
  const absl::MutexLock lock(&mutex_);
  schedule_.timeline().SetLoop(loop, schedule_.now());
  SignalIfIdle();
}

void Player::Seek(double time_s) {
  const absl::MutexLock lock(&mutex_);
  schedule_.timeline().Seek(time_s, schedule_.now());
  SignalIfIdle();
}

void Player::SignalIfIdle() {
  if (num_idle_ > 0) changed_.Signal();
}

PolledFrame Player::Poll(double now) {
  if (!mutex_.TryLock()) return polled_;
  polled_.frame = schedule_.Advance(now);
  polled_.velocity_scale = schedule_.timeline().SpeedAt(schedule_.now());
  polled_.error = statistics_.last_error;
  statistics_.counts = schedule_.counts();
  if (control_.Update(now, statistics_.counts)) {
    statistics_.level_of_detail = control_.level();
    if (options_.transport == Transport::kAutomatic) statistics_.format = control_.format();
    schedule_.SetForm(FormAt(control_.level(), statistics_.format));
  }
  mutex_.Unlock();
  return polled_;
}

std::optional<Schedule::Job> Player::WaitForJob(const std::stop_token& stop) {
  const absl::MutexLock lock(&mutex_);
  while (!stop.stop_requested()) {
    const absl::Time now = absl::Now();
    if (now >= retry_at_) {
      std::optional<Schedule::Job> job = schedule_.Next(statistics_.latency_s);
      if (job) {
        SignalIfIdle();  // there may be more
        return job;
      }
    }
    WaitForChange();
  }
  return std::nullopt;
}

// One idle thread looks by itself what has become due, so that Poll() need not wake any: the system
// would let a thread that is woken go first.
void Player::WaitForChange() {
  const bool is_watching = !std::exchange(is_one_watching_, true);
  const double moment_s = 1.0 / options_.schedule.frames_per_second;
  const absl::Duration patience =
      schedule_.is_still() ? kStillPatience : absl::Seconds(moment_s / 2);
  ++num_idle_;
  if (is_watching) {
    changed_.WaitWithTimeout(&mutex_, patience);
    is_one_watching_ = false;
  } else {
    changed_.Wait(&mutex_);
  }
  --num_idle_;
}

void Player::Work(const std::stop_token& stop) {
  while (const std::optional<Schedule::Job> job = WaitForJob(stop)) {
    std::shared_ptr<FrameMesh> frame;
    FrameCost cost;
    const absl::Status status = Get(job->spec, frame, cost);
    Finish(*job, status, std::move(frame), cost);
  }
}

absl::Status Player::Get(const FrameSpec& spec, std::shared_ptr<FrameMesh>& frame,
                         FrameCost& cost) {
  frame = pool_->Take();
  const absl::Status status = source_->Get(spec, *pool_, *frame, cost);
  if (!status.ok()) frame = nullptr;
  return status;
}

void Player::Finish(const Schedule::Job& job, const absl::Status& status, FramePtr frame,
                    const FrameCost& cost) {
  const absl::MutexLock lock(&mutex_);
  statistics_.last_error = status;
  schedule_.Deliver(job, std::move(frame));
  if (!status.ok()) {
    retry_at_ = absl::Now() + back_off_;
    back_off_ = std::min(2 * back_off_, kLongestBackOff);
    return;
  }
  back_off_ = kFirstBackOff;
  control_.AddCost(cost);
  ++statistics_.num_received;
  statistics_.num_bytes += cost.num_bytes;
  statistics_.wait_s += cost.wait_s;
  statistics_.decode_s += cost.decode_s;
  // A single call that hangs says little of the next.
  const double latency_s =
      std::min(cost.wait_s + cost.decode_s, 2 * statistics_.latency_s + kLatencyStep_s);
  statistics_.latency_s = std::lerp(statistics_.latency_s, latency_s, kLatencyShare);
}

absl::StatusOr<FramePtr> Player::WaitExact(double time_s, double patience_s) {
  const absl::Time give_up = absl::Now() + absl::Seconds(patience_s);
  FrameSpec spec = FormAt(options_.surface.level_of_detail, FrameFormat::kMeshopt);
  if (options_.transport == Transport::kDraco) spec.format = FrameFormat::kDraco;
  spec.time_s = time_s;
  {
    const absl::MutexLock lock(&mutex_);
    spec.blend = schedule_.blend();
  }
  for (absl::Duration wait = kFirstBackOff;; wait = std::min(2 * wait, kLongestBackOff)) {
    std::shared_ptr<FrameMesh> frame;
    FrameCost cost;
    const absl::Status status = Get(spec, frame, cost);
    if (status.ok()) return FramePtr(std::move(frame));
    if (!IsWorthRetrying(status)) return status;
    if (absl::Now() + wait > give_up) {
      return absl::DeadlineExceededError(
          absl::StrCat("no frame within ", patience_s, " s: ", std::string(status.message())));
    }
    absl::SleepFor(wait);
  }
}

PlayerStatistics Player::statistics() const {
  const absl::MutexLock lock(&mutex_);
  return statistics_;
}

}  // namespace liquidblend::player

#include "client/player/player.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <new>
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
// Idle threads that do not watch look again after that.
constexpr absl::Duration kLongestPatience = absl::Milliseconds(500);
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
    schedule_.SetBlend(source_only, 0.0, 0.0);
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
  OnChange();
}

void Player::SetPlaying(bool playing) {
  const absl::MutexLock lock(&mutex_);
  schedule_.timeline().SetPlaying(playing, schedule_.now());
  OnChange();
}

void Player::SetRate(double rate) {
  const absl::MutexLock lock(&mutex_);
  schedule_.timeline().SetRate(rate, schedule_.now());
  OnChange();
}

void Player::SetLoop(bool loop) {
  const absl::MutexLock lock(&mutex_);
  schedule_.timeline().SetLoop(loop, schedule_.now());
  OnChange();
}

void Player::Seek(double time_s) {
  const absl::MutexLock lock(&mutex_);
  schedule_.timeline().Seek(time_s, schedule_.now());
  OnChange();
}

// What failed before may be right now. The thread that watches sees the change soon.
void Player::OnChange() {
  retry_at_ = {};
  back_off_ = kFirstBackOff;
}

void Player::SignalIfIdle() {
  if (num_idle_ > 0) changed_.Signal();
}

PolledFrame Player::Poll(double now) {
  if (!mutex_.TryLock()) return polled_;
  try {
    PollLocked(now);
  } catch (...) {  // no memory: the lock must not stay
    mutex_.Unlock();
    throw;
  }
  mutex_.Unlock();
  return polled_;
}

void Player::PollLocked(double now) {
  polled_.frame = schedule_.Advance(now);
  polled_.velocity_scale = schedule_.timeline().SpeedAt(schedule_.now());
  polled_.error = statistics_.last_error;
  statistics_.counts = schedule_.counts();
  if (!control_.Update(now, statistics_.counts)) return;
  statistics_.level_of_detail = control_.level();
  if (options_.transport == Transport::kAutomatic) statistics_.format = control_.format();
  schedule_.SetForm(FormAt(control_.level(), statistics_.format));
}

std::optional<Schedule::Job> Player::WaitForJob(const std::stop_token& stop) {
  const absl::MutexLock lock(&mutex_);
  while (!stop.stop_requested()) {
    if (SteadyClock::now() >= retry_at_) {
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

// One idle thread looks by itself what has become due or was changed, so that neither Poll() nor
// the setters need wake any: the system would let a thread that is woken go first.
void Player::WaitForChange() {
  const bool is_watching = !std::exchange(is_one_watching_, true);
  const absl::Duration half_moment = absl::Seconds(0.5 / options_.schedule.frames_per_second);
  ++num_idle_;
  changed_.WaitWithTimeout(&mutex_, is_watching ? half_moment : kLongestPatience);
  if (is_watching) is_one_watching_ = false;
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
  try {
    frame = pool_->Take();
    const absl::Status status = source_->Get(spec, *pool_, *frame, cost);
    if (!status.ok()) frame = nullptr;
    return status;
  } catch (const std::bad_alloc&) {  // a thread of the player's must not end the program
    frame = nullptr;
    return absl::ResourceExhaustedError("no memory for a frame");
  } catch (const std::exception& exception) {  // of a library, on data that it did not expect
    frame = nullptr;
    return absl::InternalError(absl::StrCat("a frame cannot be made: ", exception.what()));
  }
}

void Player::Finish(const Schedule::Job& job, const absl::Status& status, FramePtr frame,
                    const FrameCost& cost) {
  const absl::MutexLock lock(&mutex_);
  statistics_.last_error = status;
  schedule_.Deliver(job, std::move(frame));
  const SteadyClock::time_point now = SteadyClock::now();
  if (!status.ok()) {
    if (now < retry_at_) return;  // another thread has failed just now
    retry_at_ = now + absl::ToChronoMilliseconds(back_off_);
    back_off_ = std::min(2 * back_off_, kLongestBackOff);
    return;
  }
  retry_at_ = {};
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
  const SteadyClock::time_point start = SteadyClock::now();
  FrameSpec spec = FormAt(options_.surface.level_of_detail, FrameFormat::kMeshopt);
  if (options_.transport == Transport::kDraco) spec.format = FrameFormat::kDraco;
  spec.time_s = time_s;
  spec.is_exact = true;
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
    if (absl::FromChrono(SteadyClock::now() - start) + wait > absl::Seconds(patience_s)) {
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

#include "client/player/schedule.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace liquidblend::player {
namespace {

constexpr double kSettled_s = 0.25;    // after a change of the blend, frames are got ahead again
constexpr double kMomentsAhead = 2.0;  // while it changes: beyond the latency
constexpr double kSameTime_s = 1e-9;
constexpr double kRound = 1e-6;  // of a moment

bool HaveSameTime(const FrameSpec& a, const FrameSpec& b) {
  return std::abs(a.time_s - b.time_s) < kSameTime_s;
}

// Whether both say the same surface, but for its level of detail and its way here.
bool AreSame(const FrameSpec& a, const FrameSpec& b) {
  return HaveSameTime(a, b) && a.blend == b.blend;
}

// The same level of detail as well: a picture that stands still is to be as fine as it can be.
bool AreSameStill(const FrameSpec& a, const FrameSpec& b) {
  return AreSame(a, b) && a.surface.level_of_detail == b.surface.level_of_detail;
}

}  // namespace

void Schedule::SetBlend(const BlendSpec& blend, double over_s, double now) {
  if (blend == course_.target() && (over_s > 0.0 || course_.IsSettledAt(now))) return;
  course_.Change(blend, over_s, now);
  changed_ = now;
}

FrameSpec Schedule::SpecAt(double clock) const {
  FrameSpec spec = form_;
  spec.blend = course_.At(clock);
  spec.time_s = timeline_.TimeAt(clock);
  return spec;
}

void Schedule::Start(double now) {
  has_clock_ = true;
  now_ = now;
  timeline_.Start(now);
  course_.Start(now);
  changed_ = kLongAgo;
  slots_.clear();  // of a clock that began at 0
}

FramePtr Schedule::Advance(double now) {
  if (!has_clock_) Start(now);
  now_ = std::max(now, now_);
  const auto moment = static_cast<int64_t>(std::floor(now_ * options_.frames_per_second + kRound));
  if (is_still()) {
    ShowStill();
  } else {
    ShowDue(moment);
  }
  slots_.erase(slots_.begin(), slots_.lower_bound(moment));
  return shown_.frame;
}

// Moments since the last frame that have none.
int64_t Schedule::CountMissed(int64_t moment) const {
  if (shown_.frame == nullptr || !shown_moment_) return 0;
  int64_t count = moment - *shown_moment_ - 1;
  for (auto slot = slots_.upper_bound(*shown_moment_); slot != slots_.end() && slot->first < moment;
       ++slot) {
    if (slot->second.ready.frame != nullptr) --count;
  }
  return std::max<int64_t>(count, 0);
}

// Shows the newest frame up to a moment that has not been shown yet.
void Schedule::ShowDue(int64_t moment) {
  for (auto slot = slots_.upper_bound(moment); slot != slots_.begin();) {
    --slot;
    if (shown_moment_ && slot->first <= *shown_moment_) return;
    const Shown& ready = slot->second.ready;
    const FrameSpec wanted = SpecAt(ClockAt(slot->first));
    if (ready.frame == nullptr || !HaveSameTime(ready.spec, wanted)) continue;
    if (!AreSame(ready.spec, wanted)) ++counts_.num_stale;
    counts_.num_missed += CountMissed(slot->first);
    ++counts_.num_shown;
    shown_moment_ = slot->first;
    shown_ = ready;
    return;
  }
}

// While time stands still a frame is shown as soon as it is there: of the present blend, or else
// the newest one.
void Schedule::ShowStill() {
  const FrameSpec wanted = SpecAt(now_);
  shown_moment_.reset();  // nothing is missed meanwhile
  if (shown_.frame != nullptr && AreSameStill(shown_.spec, wanted)) return;
  const bool is_shown_wrong = shown_.frame == nullptr || !HaveSameTime(shown_.spec, wanted);
  const Shown* best = nullptr;
  for (const auto& [moment, slot] : slots_) {
    if (slot.ready.frame == nullptr || !HaveSameTime(slot.ready.spec, wanted)) continue;
    const bool is_newer = best == nullptr || slot.ready.number > best->number;
    if (is_newer || AreSameStill(slot.ready.spec, wanted)) best = &slot.ready;
    if (AreSameStill(best->spec, wanted)) break;
  }
  if (best == nullptr) return;
  if (!is_shown_wrong && best->number <= shown_.number && !AreSameStill(best->spec, wanted)) return;
  shown_ = *best;
  ++counts_.num_shown;
}

// Whether nothing need be got for the slot: its frame is there or on its way.
bool Schedule::IsMet(int64_t moment, Slot& slot, const FrameSpec& wanted) {
  const bool is_still = timeline_.SpeedAt(ClockAt(moment)) == 0.0;
  const auto are_same = is_still ? AreSameStill : AreSame;
  if (slot.on_its_way && HaveSameTime(slot.on_its_way->spec, wanted)) return true;
  if (slot.ready.frame != nullptr && are_same(slot.ready.spec, wanted)) return true;
  return is_still && ReuseOther(slot, wanted);
}

// Where time stands still, the frame of another moment will do.
bool Schedule::ReuseOther(Slot& slot, const FrameSpec& wanted) {
  if (is_still() && shown_.frame != nullptr && AreSameStill(shown_.spec, wanted)) return true;
  for (const auto& [moment, other] : slots_) {
    if (other.on_its_way && AreSameStill(other.on_its_way->spec, wanted)) return true;
    if (other.ready.frame == nullptr || !AreSameStill(other.ready.spec, wanted)) continue;
    slot.ready = other.ready;
    return true;
  }
  return false;
}

int64_t Schedule::LastMoment(int64_t first, double latency_s) const {
  const bool is_settled = now_ - changed_ >= kSettled_s;
  if (is_still() && is_settled && course_.IsSettledAt(now_)) return first;
  const double ahead_s =
      is_settled ? options_.look_ahead_s : latency_s + kMomentsAhead / options_.frames_per_second;
  const double end = now_ + std::min(std::max(ahead_s, latency_s), options_.look_ahead_s);
  return std::max(first, static_cast<int64_t>(std::floor(end * options_.frames_per_second)));
}

std::optional<Schedule::Job> Schedule::Next(double latency_s) {
  if (!has_clock_) return std::nullopt;
  const double fps = options_.frames_per_second;
  const auto first = static_cast<int64_t>(std::ceil((now_ + latency_s) * fps - kRound));
  const int64_t last = LastMoment(first, latency_s);
  for (int64_t moment = first; moment <= last; ++moment) {
    const FrameSpec wanted = SpecAt(ClockAt(moment));
    Slot& slot = slots_[moment];
    if (IsMet(moment, slot, wanted)) continue;
    slot.on_its_way = Job{moment, num_jobs_++, wanted};
    return slot.on_its_way;
  }
  return std::nullopt;
}

void Schedule::Deliver(const Job& job, FramePtr frame) {
  const auto found = slots_.find(job.moment);
  const bool has_slot = found != slots_.end();
  const auto& on_its_way = has_slot ? found->second.on_its_way : std::nullopt;
  if (on_its_way && on_its_way->number == job.number) found->second.on_its_way.reset();
  // One that comes late is better than none.
  const bool is_of_use = has_slot || !shown_moment_ || job.moment > *shown_moment_;
  if (frame == nullptr || !is_of_use) return;
  if (!HaveSameTime(job.spec, SpecAt(ClockAt(job.moment)))) return;
  Shown& ready = slots_[job.moment].ready;
  if (ready.number < job.number) ready = {std::move(frame), job.spec, job.number};
}

}  // namespace liquidblend::player

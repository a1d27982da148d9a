#include "client/player/timeline.h"

#include <algorithm>
#include <cmath>

namespace liquidblend::player {
namespace {

// Whether both say the same weights or parameters, so that they can be mixed.
bool AreAlike(const BlendSpec& a, const BlendSpec& b) {
  return a.weights.size() == b.weights.size() &&
         std::equal(a.parameters.begin(), a.parameters.end(), b.parameters.begin(),
                    b.parameters.end(),
                    [](const auto& x, const auto& y) { return x.first == y.first; });
}

}  // namespace

void Timeline::SetRate(double rate, double now) {
  Anchor(now);
  rate_ = rate;
}

void Timeline::SetPlaying(bool playing, double now) {
  Anchor(now);
  playing_ = playing;
}

void Timeline::SetLoop(bool loop, double now) {
  Anchor(now);
  loop_ = loop;
}

void Timeline::Seek(double time_s, double now) {
  if (std::isnan(time_s)) return;
  anchor_now_ = now;
  anchor_time_s_ = std::clamp(time_s, 0.0, duration_s_);
}

void Timeline::Anchor(double now) {
  anchor_time_s_ = TimeAt(now);
  anchor_now_ = now;
}

double Timeline::TimeAt(double now) const {
  const double time_s = anchor_time_s_ + Speed() * (now - anchor_now_);
  if (!loop_ || duration_s_ <= 0.0) return std::clamp(time_s, 0.0, duration_s_);
  if (time_s >= 0.0 && time_s <= duration_s_) return time_s;
  const double wrapped = std::fmod(time_s, duration_s_);
  return wrapped < 0.0 ? wrapped + duration_s_ : wrapped;
}

double Timeline::SpeedAt(double now) const {
  const double speed = duration_s_ > 0.0 ? Speed() : 0.0;
  if (loop_ || speed == 0.0) return speed;
  const double time_s = TimeAt(now);
  const bool is_at_end = speed > 0.0 ? time_s >= duration_s_ : time_s <= 0.0;
  return is_at_end ? 0.0 : speed;
}

void BlendCourse::Change(const BlendSpec& to, double over_s, double now) {
  from_ = At(now);
  to_ = to;
  start_ = now;
  over_s_ = std::max(over_s, 0.0);
  if (AreAlike(from_, to_)) return;
  from_ = to_;
  over_s_ = 0.0;
}

BlendSpec BlendCourse::At(double now) const {
  if (now >= start_ + over_s_) return to_;
  const double share = std::max(0.0, (now - start_) / over_s_);
  BlendSpec blend = to_;
  for (size_t k = 0; k < blend.weights.size(); ++k) {
    blend.weights[k] = std::lerp(from_.weights[k], to_.weights[k], share);
  }
  for (auto& [name, value] : blend.parameters) {
    value = std::lerp(from_.parameters.at(name), value, share);
  }
  return blend;
}

}  // namespace liquidblend::player

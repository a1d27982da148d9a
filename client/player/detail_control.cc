#include "client/player/detail_control.h"

#include <algorithm>
#include <utility>

namespace liquidblend::player {
namespace {

constexpr double kPeriod_s = 1.0;
constexpr double kLongestPeriod_s = 1.5;
constexpr double kMostCalm_s = 120.0;  // that a step back waits for
constexpr double kTrial_s = 3.0;       // a step back that is missed within that was wrong
constexpr double kMissedShare = 0.05;  // of the moments: fewer are no reason for a step
constexpr double kSpareShare = 0.4;    // of the threads' time: a finer level takes about twice that
// Slower fetches than that may wait for the network rather than for the server.
constexpr double kSlowBytesPerSecond = 2e6;
constexpr double kWaitsLonger = 2.0;  // than decoding
constexpr double kWorthwhile = 0.9;   // of the time before: Draco has to take less
constexpr double kBarred_s = 60.0;

}  // namespace

double DetailControl::Sums::seconds_per_frame() const {
  return num_frames > 0 ? (cost.wait_s + cost.decode_s) / static_cast<double>(num_frames) : 0.0;
}

void DetailControl::AddCost(const FrameCost& cost) {
  sums_.cost.wait_s += cost.wait_s;
  sums_.cost.decode_s += cost.decode_s;
  sums_.cost.num_bytes += cost.num_bytes;
  ++sums_.num_frames;
}

bool DetailControl::Update(double now, const ScheduleCounts& counts) {
  if (!began_) {
    began_ = calm_since_ = now;
    before_ = counts;
  }
  const double passed_s = now - *began_;
  if (passed_s < kPeriod_s) return false;
  const auto num_shown = static_cast<double>(counts.num_shown - before_.num_shown);
  const auto num_missed = static_cast<double>(counts.num_missed - before_.num_missed);
  const Sums sums = sums_;
  began_ = now;
  before_ = counts;
  sums_ = {};
  if (!std::exchange(is_warm_, true)) return false;
  // A program that did not poll for a while, or a server that is away, says nothing of the cost.
  if (passed_s > kLongestPeriod_s || (num_missed > 0 && sums.num_frames == 0)) {
    calm_since_ = now;
    return false;
  }
  const bool is_missing = num_missed > kMissedShare * (num_shown + num_missed);
  if (GiveUpDraco(sums, is_missing, now)) return true;
  if (is_missing) {
    calm_since_ = now;
    if (now - stepped_up_ <= kTrial_s) {
      calm_needed_s_ = std::min(2.0 * calm_needed_s_, kMostCalm_s);
    }
    return StepDown(sums, now);
  }
  if (now - calm_since_ < calm_needed_s_) return false;
  calm_since_ = now;
  const double busy_s = sums.cost.wait_s + sums.cost.decode_s;
  if (!StepUp(busy_s / (passed_s * options_.num_threads))) return false;
  stepped_up_ = now;
  return true;
}

// Whether Draco is taken back: it did not help in its first second, or decoding it is what takes
// the time.
bool DetailControl::GiveUpDraco(const Sums& sums, bool is_missing, double now) {
  const double before_s = std::exchange(before_draco_s_, 0.0);
  const bool has_failed = before_s > 0.0 && sums.seconds_per_frame() > kWorthwhile * before_s;
  const bool is_slow_to_decode = is_missing && sums.cost.decode_s > sums.cost.wait_s;
  if (!options_.may_change_format || format_ != FrameFormat::kDraco) return false;
  if (!has_failed && !is_slow_to_decode) return false;
  format_ = FrameFormat::kMeshopt;
  draco_barred_until_ = now + kBarred_s;
  return true;
}

bool DetailControl::StepDown(const Sums& sums, double now) {
  const FrameCost& cost = sums.cost;
  const bool is_slow = static_cast<double>(cost.num_bytes) < kSlowBytesPerSecond * cost.wait_s;
  const bool may_be_network = is_slow && cost.wait_s > kWaitsLonger * cost.decode_s;
  const bool may_change = options_.may_change_format && now >= draco_barred_until_;
  if (may_change && may_be_network && format_ == FrameFormat::kMeshopt) {
    format_ = FrameFormat::kDraco;
    before_draco_s_ = sums.seconds_per_frame();
    return true;
  }
  if (level_ >= options_.coarsest) return false;
  ++level_;
  return true;
}

bool DetailControl::StepUp(double busy_share) {
  if (busy_share > kSpareShare) return false;
  if (level_ > options_.finest) {
    --level_;
    return true;
  }
  if (!options_.may_change_format || format_ == FrameFormat::kMeshopt) return false;
  format_ = FrameFormat::kMeshopt;
  return true;
}

}  // namespace liquidblend::player

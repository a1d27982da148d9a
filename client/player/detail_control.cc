#include "client/player/detail_control.h"

#include <algorithm>

namespace liquidblend::player {
namespace {

constexpr double kPeriod_s = 1.0;
constexpr double kMostCalm_s = 120.0;  // that a step back waits for
constexpr double kTrial_s = 3.0;       // a step back that is missed within that was wrong
constexpr double kMissedShare = 0.05;  // of the moments: fewer are no reason for a step
constexpr double kSpareShare = 0.4;    // of the threads' time: a finer level takes about twice that
constexpr double kWaitsLonger = 2.0;   // than decoding: the network is what is slow

}  // namespace

void DetailControl::AddCost(const FrameCost& cost) {
  cost_.wait_s += cost.wait_s;
  cost_.decode_s += cost.decode_s;
}

bool DetailControl::Update(double now, const ScheduleCounts& counts) {
  if (began_ < 0.0) {
    began_ = calm_since_ = now;
    before_ = counts;
  }
  const double passed_s = now - began_;
  if (passed_s < kPeriod_s) return false;
  const auto num_shown = static_cast<double>(counts.num_shown - before_.num_shown);
  const auto num_missed = static_cast<double>(counts.num_missed - before_.num_missed);
  const FrameCost cost = cost_;
  began_ = now;
  before_ = counts;
  cost_ = {};
  if (num_missed > kMissedShare * (num_shown + num_missed)) {
    calm_since_ = now;
    if (now - stepped_up_ <= kTrial_s) {
      calm_needed_s_ = std::min(2.0 * calm_needed_s_, kMostCalm_s);
    }
    return StepDown(cost.wait_s, cost.decode_s);
  }
  if (now - calm_since_ < calm_needed_s_) return false;
  calm_since_ = now;
  if (!StepUp((cost.wait_s + cost.decode_s) / (passed_s * options_.num_threads))) return false;
  stepped_up_ = now;
  return true;
}

bool DetailControl::StepDown(double wait_s, double decode_s) {
  const bool is_network = wait_s > kWaitsLonger * decode_s;
  if (options_.may_change_format && is_network && format_ == FrameFormat::kMeshopt) {
    format_ = FrameFormat::kDraco;
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

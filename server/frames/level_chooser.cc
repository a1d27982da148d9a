#include "server/frames/level_chooser.h"

#include <algorithm>

namespace liquidblend::server {
namespace {

constexpr double kNewShare = 0.3;  // of the newest frame in the running mean
constexpr double kTooBusy = 0.8;
constexpr double kQuietEnough = 0.4;  // the next finer level has about twice the bytes
constexpr double kUndecided = 0.6;    // after a step: the past says nothing about the new level
constexpr double kMaxRatio = 2.0;     // one slow frame alone decides nothing

}  // namespace

void LevelChooser::OnWritten(absl::Duration took, absl::Duration period, int max_coarser,
                             absl::Duration now) {
  num_coarser_ = std::min(num_coarser_, max_coarser);
  const double ratio = std::min(kMaxRatio, absl::FDivDuration(took, period));
  busy_ += kNewShare * (ratio - busy_);
  if (busy_ > kTooBusy && num_coarser_ < max_coarser) {
    GoCoarser(now);
  } else if (busy_ < kQuietEnough && num_coarser_ > 0 && now - since_ >= quiet_) {
    GoFiner(now);
  }
}

void LevelChooser::GoCoarser(absl::Duration now) {
  const bool has_failed = was_trial_ && now - since_ < quiet_;
  quiet_ = has_failed ? std::min(2 * quiet_, kMaxQuiet) : kFirstQuiet;
  ++num_coarser_;
  was_trial_ = false;
  since_ = now;
  busy_ = kUndecided;
}

void LevelChooser::GoFiner(absl::Duration now) {
  --num_coarser_;
  was_trial_ = true;
  since_ = now;
  busy_ = kUndecided;
}

}  // namespace liquidblend::server

#include "server/access/quotas.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

constexpr absl::Duration kStreamRetryDelay = absl::Seconds(1);
constexpr absl::Duration kIdle = absl::Minutes(1);  // by then a budget of one call a second is full

double Burst(const Principal& principal) {
  return std::max(1.0, principal.limits.requests_per_second);
}

}  // namespace

// Gives a stream back at its end, once it is counted.
class Quotas::Permit {
 public:
  Permit(Quotas& quotas, std::string key) : quotas_(quotas), key_(std::move(key)) {}
  ~Permit() {
    if (is_counted_) quotas_.GiveBack(key_);
  }
  Permit(const Permit&) = delete;
  Permit& operator=(const Permit&) = delete;

  void SetCounted() { is_counted_ = true; }

 private:
  Quotas& quotas_;
  const std::string key_;
  bool is_counted_ = false;
};

absl::Status Quotas::CountRequest(const Principal& principal) {
  const double rate = principal.limits.requests_per_second;
  if (rate == 0) return absl::OkStatus();
  const absl::Time now = now_();
  absl::MutexLock lock(&mutex_);
  ForgetIdle(now);
  const auto [entry, is_new] = usages_.try_emplace(principal.key);
  Usage& usage = entry->second;
  const double earned = rate * std::max(0.0, absl::ToDoubleSeconds(now - usage.time));
  usage.requests_left = std::min(Burst(principal), usage.requests_left + earned);
  usage.time = now;
  if (usage.requests_left >= 1) {
    usage.requests_left -= 1;
    return absl::OkStatus();
  }
  const absl::Duration delay = absl::Seconds((1 - usage.requests_left) / rate);
  return WithRetryDelay(
      WithReason(absl::ResourceExhaustedError(
                     absl::StrCat("'", principal.name, "' may make ", rate, " calls per second")),
                 "RATE_LIMITED", {{"principal", principal.name}, {"limit", absl::StrCat(rate)}}),
      delay);
}

absl::StatusOr<StreamPermit> Quotas::TakeStream(const Principal& principal) {
  const int max_streams = principal.limits.max_streams;
  if (max_streams == 0) return StreamPermit();
  const absl::Time now = now_();
  // Before the lock, which the end of a permit takes, and before anything is counted: there may be
  // no memory for it.
  const auto permit = std::make_shared<Permit>(*this, principal.key);
  absl::MutexLock lock(&mutex_);
  ForgetIdle(now);
  Usage& usage = usages_[principal.key];
  if (usage.num_streams >= max_streams) {
    return WithRetryDelay(
        WithReason(absl::ResourceExhaustedError(absl::StrCat("'", principal.name, "' may have ",
                                                             max_streams, " streams at a time")),
                   "TOO_MANY_STREAMS",
                   {{"principal", principal.name}, {"limit", absl::StrCat(max_streams)}}),
        kStreamRetryDelay);
  }
  ++usage.num_streams;
  permit->SetCounted();
  return permit;
}

int64_t Quotas::num_sweeps() const {
  absl::MutexLock lock(&mutex_);
  return num_sweeps_;
}

void Quotas::GiveBack(const std::string& key) {
  absl::MutexLock lock(&mutex_);
  --usages_[key].num_streams;
}

// Anonymous callers are told apart by their hosts, of which there may be any number. A sweep looks
// at all of them, so the next one waits until they are twice as many, or may be idle by now.
void Quotas::ForgetIdle(absl::Time now) {
  if (usages_.size() < kManyUsages) return;
  if (usages_.size() < num_at_next_sweep_ && now - swept_at_ <= kIdle) return;
  for (auto entry = usages_.begin(); entry != usages_.end();) {
    const bool is_idle = entry->second.num_streams == 0 && now - entry->second.time > kIdle;
    entry = is_idle ? usages_.erase(entry) : std::next(entry);
  }
  num_at_next_sweep_ = std::max(kManyUsages, 2 * usages_.size());
  swept_at_ = now;
  ++num_sweeps_;
}

}  // namespace liquidblend::server

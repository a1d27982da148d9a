#include "client/src/retry.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/src/status.h"

namespace liquidblend::client {
namespace {

constexpr absl::Duration kShortestPause = absl::Milliseconds(100);
constexpr absl::Duration kLongestPause = absl::Seconds(1);

// The same error with another message.
absl::Status WithMessage(const absl::Status& status, const std::string& message) {
  absl::Status changed(status.code(), message);
  status.ForEachPayload(
      [&](absl::string_view url, const absl::Cord& payload) { changed.SetPayload(url, payload); });
  return changed;
}

absl::Status WithAttempts(const absl::Status& status, int num_attempts) {
  const bool is_repeatable = absl::IsUnavailable(status) || RetryDelay(status).has_value();
  if (!is_repeatable || num_attempts == 1) return status;
  return WithMessage(status,
                     absl::StrCat(status.message(), " (after ", num_attempts, " attempts)"));
}

}  // namespace

Backoff::Backoff(const RetryOptions& options)
    : options_(options), random_(std::random_device{}()) {}

bool Backoff::ShouldRetry(const absl::Status& status) {
  asked_ = options_.patience > absl::ZeroDuration() ? RetryDelay(status) : std::nullopt;
  if (!asked_.has_value()) {
    return absl::IsUnavailable(status) && num_unreached_ < options_.max_attempts;
  }
  asked_ = std::max(*asked_, options_.initial_backoff);
  return waited_ + *asked_ <= options_.patience;
}

absl::Duration Backoff::NextWait() {
  ++num_attempts_;
  if (asked_.has_value()) {
    const absl::Duration wait = std::min(Times(*asked_, 1.0, 1.25), options_.patience - waited_);
    waited_ += wait;
    return wait;
  }
  const int doublings = std::min(num_unreached_ - 1, 30);
  ++num_unreached_;
  const absl::Duration longest =
      std::min(options_.initial_backoff * (int64_t{1} << doublings), options_.max_backoff);
  return Times(longest, 0.5, 1.0);
}

absl::Duration Backoff::Times(absl::Duration wait, double lowest, double highest) {
  return wait * std::uniform_real_distribution<double>(lowest, highest)(random_);
}

void Backoff::Reset() {
  num_attempts_ = 1;
  num_unreached_ = 1;
  waited_ = absl::ZeroDuration();
}

PatientBackoff::PatientBackoff(const RetryOptions& options)
    : options_(options), backoff_(options) {}

std::optional<absl::Duration> PatientBackoff::NextPause(const absl::Status& status,
                                                        absl::Time now) {
  const bool is_away = absl::IsUnavailable(status);
  lost_at_ = std::min(lost_at_, now);
  const bool is_next_attempt = backoff_.ShouldRetry(status);
  if (!is_next_attempt && (!is_away || now - lost_at_ >= options_.patience)) return std::nullopt;
  ++num_attempts_;
  const absl::Duration wait = is_next_attempt ? backoff_.NextWait() : options_.max_backoff;
  return is_away ? std::clamp(wait, kShortestPause, kLongestPause) : wait;
}

void PatientBackoff::Reset() {
  backoff_.Reset();
  num_attempts_ = 1;
  lost_at_ = absl::InfiniteFuture();
}

absl::Status RetryUnavailable(const RetryOptions& options,
                              const std::function<absl::Status(int attempt)>& call) {
  Backoff backoff(options);
  absl::Status status = call(1);
  while (backoff.ShouldRetry(status)) {
    absl::SleepFor(backoff.NextWait());
    status = call(backoff.num_attempts());
  }
  return WithAttempts(status, backoff.num_attempts());
}

absl::Status RetryPatiently(const RetryOptions& options,
                            const std::function<absl::Status()>& call) {
  PatientBackoff backoff(options);
  for (;;) {
    const absl::Status status = call();
    const std::optional<absl::Duration> pause = backoff.NextPause(status, absl::Now());
    if (!pause.has_value()) return WithAttempts(status, backoff.num_attempts());
    absl::SleepFor(*pause);
  }
}

}  // namespace liquidblend::client

#include "client/src/retry.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace liquidblend::client {

Backoff::Backoff(const RetryOptions& options)
    : options_(options), random_(std::random_device{}()) {}

bool Backoff::ShouldRetry(const absl::Status& status) const {
  return absl::IsUnavailable(status) && num_attempts_ < options_.max_attempts;
}

absl::Duration Backoff::NextWait() {
  const int doublings = std::min(num_attempts_ - 1, 30);
  ++num_attempts_;
  const absl::Duration longest =
      std::min(options_.initial_backoff * (int64_t{1} << doublings), options_.max_backoff);
  return longest * std::uniform_real_distribution<double>(0.5, 1.0)(random_);
}

void Backoff::Reset() { num_attempts_ = 1; }

absl::Status RetryUnavailable(const RetryOptions& options,
                              const std::function<absl::Status(int attempt)>& call) {
  Backoff backoff(options);
  absl::Status status = call(1);
  while (backoff.ShouldRetry(status)) {
    absl::SleepFor(backoff.NextWait());
    status = call(backoff.num_attempts());
  }
  if (absl::IsUnavailable(status) && backoff.num_attempts() > 1) {
    return absl::UnavailableError(
        absl::StrCat(status.message(), " (after ", backoff.num_attempts(), " attempts)"));
  }
  return status;
}

}  // namespace liquidblend::client

#include "client/src/retry.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/src/status.h"

namespace liquidblend::client {
namespace {

// The same error with more to read.
absl::Status WithMessage(const absl::Status& status, const std::string& message) {
  absl::Status changed(status.code(), message);
  status.ForEachPayload(
      [&](absl::string_view url, const absl::Cord& payload) { changed.SetPayload(url, payload); });
  return changed;
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

absl::Status RetryUnavailable(const RetryOptions& options,
                              const std::function<absl::Status(int attempt)>& call) {
  Backoff backoff(options);
  absl::Status status = call(1);
  while (backoff.ShouldRetry(status)) {
    absl::SleepFor(backoff.NextWait());
    status = call(backoff.num_attempts());
  }
  const bool is_repeatable = absl::IsUnavailable(status) || RetryDelay(status).has_value();
  if (!is_repeatable || backoff.num_attempts() == 1) return status;
  return WithMessage(
      status, absl::StrCat(status.message(), " (after ", backoff.num_attempts(), " attempts)"));
}

}  // namespace liquidblend::client

#include "client/src/retry.h"

#include <gtest/gtest.h>

namespace liquidblend::client {
namespace {

TEST(Backoff, DoublesUpToTheLongestWaitWithJitterBelow) {
  RetryOptions options;
  options.max_attempts = 100;
  options.initial_backoff = absl::Milliseconds(100);
  options.max_backoff = absl::Milliseconds(800);
  Backoff backoff(options);
  for (int i = 0; i < 80; ++i) {
    const absl::Duration longest = absl::Milliseconds(i < 3 ? 100 << i : 800);
    const absl::Duration wait = backoff.NextWait();
    EXPECT_GE(wait, longest * 0.5) << i;
    EXPECT_LE(wait, longest) << i;
  }
}

TEST(Backoff, RepeatsOnlyWhatWasUnavailableAndOnlySoOften) {
  RetryOptions options;
  options.max_attempts = 2;
  Backoff backoff(options);
  EXPECT_FALSE(backoff.ShouldRetry(absl::OkStatus()));
  EXPECT_FALSE(backoff.ShouldRetry(absl::DeadlineExceededError("")));
  EXPECT_TRUE(backoff.ShouldRetry(absl::UnavailableError("")));
  backoff.NextWait();
  EXPECT_FALSE(backoff.ShouldRetry(absl::UnavailableError("")));
  backoff.Reset();
  EXPECT_TRUE(backoff.ShouldRetry(absl::UnavailableError("")));
}

TEST(RetryUnavailable, TellsTheCallWhichAttemptItIs) {
  RetryOptions options;
  options.initial_backoff = absl::Microseconds(1);
  std::vector<int> attempts;
  const absl::Status status = RetryUnavailable(options, [&](int attempt) {
    attempts.push_back(attempt);
    return attempt < 3 ? absl::UnavailableError("away") : absl::OkStatus();
  });
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(attempts, (std::vector<int>{1, 2, 3}));
}

}  // namespace
}  // namespace liquidblend::client

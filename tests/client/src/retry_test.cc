#include "client/src/retry.h"

#include <gtest/gtest.h>

#include <optional>

#include "client/src/status.h"
#include "tests/client/fake_server.h"

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

absl::Status Busy(absl::Duration delay) {
  return testing::WithRetryDelay(absl::ResourceExhaustedError("busy"), delay);
}

TEST(Backoff, WaitsAsLongAsTheServerAsksAndALittleLonger) {
  RetryOptions options;
  options.max_attempts = 1;  // does not count here
  options.initial_backoff = absl::Milliseconds(1);
  options.patience = absl::Hours(1);
  Backoff backoff(options);
  for (int i = 0; i < 80; ++i) {
    ASSERT_TRUE(backoff.ShouldRetry(Busy(absl::Milliseconds(400))));
    const absl::Duration wait = backoff.NextWait();
    EXPECT_GE(wait, absl::Milliseconds(400));
    EXPECT_LE(wait, absl::Milliseconds(500));
  }
  ASSERT_TRUE(backoff.ShouldRetry(Busy(absl::ZeroDuration())));
  EXPECT_GE(backoff.NextWait(), options.initial_backoff) << "never at once";
}

TEST(Backoff, WhatTheServerAsksForMustFitIntoThePatience) {
  RetryOptions options;
  options.patience = absl::Seconds(10);
  Backoff backoff(options);
  EXPECT_FALSE(backoff.ShouldRetry(Busy(absl::Seconds(11))));
  absl::Duration waited;
  int num_waits = 0;
  while (backoff.ShouldRetry(Busy(absl::Seconds(3)))) {
    waited += backoff.NextWait();
    ++num_waits;
  }
  EXPECT_GE(num_waits, 2);
  EXPECT_LE(waited, options.patience);
  backoff.Reset();
  EXPECT_TRUE(backoff.ShouldRetry(Busy(absl::Seconds(3))));
}

TEST(Backoff, WithoutPatienceOnlyWhatWasUnavailableIsRepeated) {
  RetryOptions options;
  options.patience = absl::ZeroDuration();
  Backoff backoff(options);
  EXPECT_FALSE(backoff.ShouldRetry(Busy(absl::Milliseconds(1))));
  const absl::Status away = testing::WithRetryDelay(absl::UnavailableError("away"), absl::Hours(1));
  ASSERT_TRUE(backoff.ShouldRetry(away));
  EXPECT_LE(backoff.NextWait(), options.initial_backoff);
}

// What our servers say while they cannot serve; the clock is the test's.
TEST(PatientBackoff, PausesATenthToOneSecondUntilThePatienceIsOver) {
  RetryOptions options;
  options.patience = absl::Minutes(2);
  for (const absl::Status& away :
       {absl::UnavailableError("away"),
        testing::WithRetryDelay(absl::UnavailableError("away"), absl::Seconds(1))}) {
    PatientBackoff backoff(options);
    const absl::Time lost_at = absl::UnixEpoch();
    absl::Time now = lost_at;
    while (const std::optional<absl::Duration> pause = backoff.NextPause(away, now)) {
      ASSERT_GE(*pause, absl::Milliseconds(100));
      ASSERT_LE(*pause, absl::Seconds(1));
      now += *pause;
    }
    EXPECT_GE(now - lost_at, options.patience);
    EXPECT_LE(now - lost_at, options.patience + absl::Seconds(1));
    EXPECT_LE(backoff.num_attempts(), 130);
  }
}

TEST(PatientBackoff, CountsFromTheLossOfTheConnection) {
  RetryOptions options;
  options.max_attempts = 1;
  options.patience = absl::Seconds(10);
  const absl::Status away = absl::UnavailableError("away");
  PatientBackoff backoff(options);
  const absl::Time lost_at = absl::UnixEpoch();
  EXPECT_TRUE(backoff.NextPause(away, lost_at).has_value());
  EXPECT_TRUE(backoff.NextPause(away, lost_at + absl::Seconds(9)).has_value());
  EXPECT_FALSE(backoff.NextPause(away, lost_at + absl::Seconds(10)).has_value());
  backoff.Reset();
  EXPECT_TRUE(backoff.NextPause(away, lost_at + absl::Hours(1)).has_value());
  EXPECT_FALSE(backoff.NextPause(absl::InternalError("broken"), lost_at).has_value());
}

TEST(PatientBackoff, WaitsAsLongAsABusyServerAsks) {
  PatientBackoff backoff({});
  const auto pause = backoff.NextPause(Busy(absl::Seconds(9)), absl::UnixEpoch());
  ASSERT_TRUE(pause.has_value());
  EXPECT_GE(*pause, absl::Seconds(9));
  EXPECT_FALSE(backoff.NextPause(Busy(absl::Hours(1)), absl::UnixEpoch()).has_value());
}

TEST(RetryUnavailable, AnErrorThatIsGivenUpOnKeepsItsDelay) {
  RetryOptions options;
  options.initial_backoff = absl::Microseconds(1);
  options.patience = absl::Milliseconds(30);
  const absl::Status status =
      RetryUnavailable(options, [&](int attempt) { return Busy(absl::Milliseconds(9) * attempt); });
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message(), "busy (after 3 attempts)");
  EXPECT_EQ(RetryDelay(status), absl::Milliseconds(27));
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

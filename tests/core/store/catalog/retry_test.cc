#include "core/store/catalog/retry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <set>

#include "core/base/data_limit.h"
#include "core/base/posix_file.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;

RetryOptions WithRandom(double random) {
  RetryOptions options;
  options.random = [=] { return random; };
  return options;
}

TEST(PauseAfter, DoublesUpToTheLongest) {
  const RetryOptions options = WithRandom(0.5);
  EXPECT_EQ(PauseAfter(1, options), absl::Seconds(1));
  EXPECT_EQ(PauseAfter(2, options), absl::Seconds(2));
  EXPECT_EQ(PauseAfter(9, options), absl::Seconds(256));
  EXPECT_EQ(PauseAfter(10, options), absl::Minutes(5));
  EXPECT_EQ(PauseAfter(2'000'000'000, options), absl::Minutes(5));
}

TEST(PauseAfter, DiffersByAQuarterAtMost) {
  EXPECT_EQ(PauseAfter(1, WithRandom(0.0)), absl::Milliseconds(750));
  EXPECT_EQ(PauseAfter(3, WithRandom(0.0)), absl::Seconds(3));
  std::set<absl::Duration> pauses;
  for (int k = 0; k < 100; ++k) {
    const absl::Duration pause = PauseAfter(1, RetryOptions());
    EXPECT_GE(pause, absl::Milliseconds(750));
    EXPECT_LE(pause, absl::Milliseconds(1250));
    pauses.insert(pause);
  }
  EXPECT_GT(pauses.size(), 50u);
}

TEST(PauseAfter, LetsAnEnvironmentFailForADay) {
  RetryOptions options = WithRandom(0.5);
  absl::Duration waited;
  for (int k = 1; k < options.max_environment_failures; ++k) waited += PauseAfter(k, options);
  EXPECT_GT(waited, absl::Hours(24));
  EXPECT_LT(waited, absl::Hours(25));
}

TEST(PauseAfter, MayBeNone) {
  RetryOptions options;
  options.first_pause = absl::ZeroDuration();
  EXPECT_EQ(PauseAfter(7, options), absl::ZeroDuration());
}

TEST(RetryOptions, NamesWhatIsOutOfRange) {
  EXPECT_THAT(RetryOptions().Validate(), Succeeds());
  const auto status = [](const auto& change) {
    RetryOptions options;
    change(options);
    return options.Validate();
  };
  EXPECT_THAT(status([](auto& o) { o.max_attempts = 0; }),
              Fails(Code::kInvalidArgument, "max_attempts = 0"));
  EXPECT_THAT(status([](auto& o) { o.max_environment_failures = 0; }),
              Fails(Code::kInvalidArgument, "max_environment_failures = 0"));
  EXPECT_THAT(status([](auto& o) { o.first_pause = -absl::Seconds(1); }),
              Fails(Code::kInvalidArgument, "first_pause = -1s"));
  EXPECT_THAT(status([](auto& o) { o.longest_pause = absl::Milliseconds(1); }),
              Fails(Code::kInvalidArgument, "longest_pause = 1ms"));
  EXPECT_THAT(status([](auto& o) { o.longest_pause = absl::Minutes(9); }),
              Fails(Code::kInvalidArgument, "longest_pause = 9m"));
  EXPECT_THAT(status([](auto& o) { o.jitter = 1.0; }), Fails(Code::kInvalidArgument, "jitter = 1"));
}

}  // namespace
}  // namespace liquidblend::store

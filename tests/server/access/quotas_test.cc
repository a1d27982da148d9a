#include "server/access/quotas.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;

Principal Named(const std::string& name) {
  Principal principal;
  principal.name = name;
  principal.key = name;
  return principal;
}

class QuotasTest : public testing::Test {
 protected:
  absl::Time now_ = absl::UnixEpoch();
  Quotas quotas_{[this] { return now_; }};
};

TEST_F(QuotasTest, ASecondsWorthMayComeAtOnceThenTheRateCounts) {
  Principal busy = Named("busy");
  busy.limits.requests_per_second = 4;
  for (int k = 0; k < 4; ++k) EXPECT_TRUE(quotas_.CountRequest(busy).ok()) << k;
  const absl::Status refused = quotas_.CountRequest(busy);
  EXPECT_THAT(refused, Fails(absl::StatusCode::kResourceExhausted, "4 calls per second"));
  EXPECT_EQ(ReasonOf(refused), "RATE_LIMITED");
  EXPECT_EQ(RetryDelayOf(refused), absl::Milliseconds(250));
  EXPECT_TRUE(quotas_.CountRequest(Named("other")).ok());
  now_ += RetryDelayOf(refused);
  EXPECT_TRUE(quotas_.CountRequest(busy).ok());
  EXPECT_FALSE(quotas_.CountRequest(busy).ok());
  now_ += absl::Hours(1);
  for (int k = 0; k < 4; ++k) EXPECT_TRUE(quotas_.CountRequest(busy).ok()) << k;
  EXPECT_FALSE(quotas_.CountRequest(busy).ok());
}

TEST_F(QuotasTest, LessThanOneCallPerSecondIsARateToo) {
  Principal slow = Named("slow");
  slow.limits.requests_per_second = 0.1;
  EXPECT_TRUE(quotas_.CountRequest(slow).ok());
  EXPECT_EQ(RetryDelayOf(quotas_.CountRequest(slow)), absl::Seconds(10));
}

TEST_F(QuotasTest, AStreamCountsUntilItsPermitIsGone) {
  Principal viewer = Named("viewer");
  viewer.limits.max_streams = 2;
  std::vector<StreamPermit> permits = {*quotas_.TakeStream(viewer), *quotas_.TakeStream(viewer)};
  const absl::Status refused = quotas_.TakeStream(viewer).status();
  EXPECT_THAT(refused, Fails(absl::StatusCode::kResourceExhausted, "2 streams"));
  EXPECT_EQ(ReasonOf(refused), "TOO_MANY_STREAMS");
  EXPECT_GT(RetryDelayOf(refused), absl::ZeroDuration());
  permits.pop_back();
  EXPECT_TRUE(quotas_.TakeStream(viewer).ok());
}

TEST_F(QuotasTest, ForgettingIdleCallersForgetsNoOpenStream) {
  Principal viewer = Named("viewer");
  viewer.limits.max_streams = 1;
  const StreamPermit permit = *quotas_.TakeStream(viewer);
  for (int k = 0; k < 10'000; ++k) {
    Principal passing = Named(absl::StrCat("passing ", k));
    passing.limits.requests_per_second = 1;
    EXPECT_TRUE(quotas_.CountRequest(passing).ok());
    now_ += absl::Seconds(1);
  }
  EXPECT_FALSE(quotas_.TakeStream(viewer).ok());
}

// A look at all callers for each call would take time quadratic in their number.
TEST_F(QuotasTest, ManyCallersAreLookedThroughRarely) {
  const auto call_from = [&](int first, int last) {
    for (int k = first; k < last; ++k) {
      Principal passing = Named(absl::StrCat("passing ", k));
      passing.limits.requests_per_second = 1;
      passing.limits.max_streams = 1;
      EXPECT_TRUE(quotas_.CountRequest(passing).ok());
      EXPECT_TRUE(quotas_.TakeStream(passing).ok());
    }
  };
  call_from(0, 20'000);
  EXPECT_LE(quotas_.num_sweeps(), 3) << "none of them is idle yet";
  const int64_t num_before = quotas_.num_sweeps();
  now_ += absl::Minutes(2);
  call_from(0, 1);
  EXPECT_EQ(quotas_.num_sweeps(), num_before + 1);
  now_ += absl::Minutes(2);
  call_from(20'000, 24'000);
  EXPECT_EQ(quotas_.num_sweeps(), num_before + 1) << "idle ones are still there";
}

}  // namespace
}  // namespace liquidblend::server

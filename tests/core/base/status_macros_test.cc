#include "core/base/status_macros.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

namespace liquidblend::base {
namespace {

absl::Status Fail() { return absl::NotFoundError("frame 7"); }

absl::StatusOr<std::unique_ptr<int>> MakeOwned(int value) {
  if (value < 0) return absl::OutOfRangeError("below 0");
  return std::make_unique<int>(value);
}

TEST(ReturnIfError, PassesOnTheFirstErrorAndEvaluatesOnce) {
  int num_calls = 0;
  const auto run = [&](bool fails) -> absl::Status {
    LB_RETURN_IF_ERROR((++num_calls, fails ? Fail() : absl::OkStatus()));
    return absl::InternalError("went on");
  };
  EXPECT_EQ(run(true), absl::NotFoundError("frame 7"));
  EXPECT_EQ(num_calls, 1);
  EXPECT_EQ(run(false), absl::InternalError("went on"));
}

TEST(AssignOrReturn, MovesTheValueOrPassesOnTheError) {
  const auto run = [](int first, int second) -> absl::StatusOr<int> {
    LB_ASSIGN_OR_RETURN(const std::unique_ptr<int> a, MakeOwned(first));
    std::unique_ptr<int> b;
    LB_ASSIGN_OR_RETURN(b, MakeOwned(second));
    return *a + *b;
  };
  EXPECT_EQ(*run(3, 4), 7);
  EXPECT_EQ(run(3, -4).status(), absl::OutOfRangeError("below 0"));
}

}  // namespace
}  // namespace liquidblend::base

#include "core/base/exit_status.h"

#include <gtest/gtest.h>

namespace liquidblend::base {
namespace {

TEST(ExitStatusOf, GoesByTheErrorsCode) {
  EXPECT_EQ(ExitStatusOf(absl::OkStatus()), 0);
  EXPECT_EQ(ExitStatusOf(absl::InternalError("")), 1);
  EXPECT_EQ(ExitStatusOf(absl::ResourceExhaustedError("")), 1);
  EXPECT_EQ(ExitStatusOf(absl::InvalidArgumentError("")), 2);
  EXPECT_EQ(ExitStatusOf(absl::UnavailableError("")), 3);
  EXPECT_EQ(ExitStatusOf(absl::DataLossError("")), 7);
}

TEST(ExitStatusOfCheck, TellsOnlyUsageFromOtherErrors) {
  EXPECT_EQ(ExitStatusOfCheck(absl::OkStatus()), 0);
  EXPECT_EQ(ExitStatusOfCheck(absl::InvalidArgumentError("")), 2);
  EXPECT_EQ(ExitStatusOfCheck(absl::UnavailableError("")), 1);
  EXPECT_EQ(ExitStatusOfCheck(absl::DataLossError("")), 1);
}

}  // namespace
}  // namespace liquidblend::base

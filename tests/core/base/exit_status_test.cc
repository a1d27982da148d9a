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

}  // namespace
}  // namespace liquidblend::base

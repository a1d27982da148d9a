#include "client/cli/print/wait.h"

#include <gtest/gtest.h>

namespace liquidblend::cli {
namespace {

TEST(DescribeProgress, TellsWhyThereIsAnotherAttempt) {
  Progress progress;
  progress.stage = "registration";
  progress.num_iterations = 20;
  progress.target_index = 1;
  progress.attempt = 1;
  const std::string first = DescribeProgress(progress);
  EXPECT_EQ(first.find("attempt"), std::string::npos) << first;
  progress.attempt = 2;
  progress.seconds_left = 5;
  progress.last_failure = absl::FailedPreconditionError("registered by another version");
  const std::string second = DescribeProgress(progress);
  EXPECT_NE(
      second.find(", attempt 2, 0:05 left; the attempt before: registered by another version"),
      std::string::npos)
      << second;
}

TEST(HowToWatch, HasCommandsForNamesThatAreSafeToPaste) {
  EXPECT_EQ(HowToWatch("operations/import-1"),
            "`liquidblend operations operations/import-1 --wait` watches it, `liquidblend cancel "
            "operations/import-1` cancels it.");
  for (const char* name : {"a`rm b`", "a; b", "$(b)", "--wait", "a\x1B[2Kb"}) {
    EXPECT_EQ(HowToWatch(name), "Its name is not one to copy; `liquidblend operations` lists all.");
  }
}

}  // namespace
}  // namespace liquidblend::cli

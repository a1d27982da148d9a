#include "core/base/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace liquidblend::base {
namespace {

TEST(Log, PrintsOneLinePerEventWithProgramAndLevelFromTheLowestOn) {
  testing::internal::CaptureStderr();
  StartLog("test-program", LogLevel::kInfo);
  Log(LogLevel::kDebug, "too low");
  LogInfo("{} is text");
  LogError("worse");
  const std::string printed = testing::internal::GetCapturedStderr();
  EXPECT_THAT(printed, testing::ContainsRegex("test-program.*info: \\{\\} is text\n"));
  EXPECT_THAT(printed, testing::ContainsRegex("test-program.*error: worse\n"));
  EXPECT_THAT(printed, testing::Not(testing::HasSubstr("too low")));
}

}  // namespace
}  // namespace liquidblend::base

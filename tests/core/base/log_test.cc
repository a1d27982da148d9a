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

TEST(Log, FieldsFollowTheMessageAndNothingBreaksTheLine) {
  testing::internal::CaptureStderr();
  StartLog("test-program", LogLevel::kDebug);
  Log(LogLevel::kInfo, "call", {{"method", "GetFrame"}, {"error", "a \"b\"\nc"}, {"empty", ""}});
  const std::string printed = testing::internal::GetCapturedStderr();
  EXPECT_THAT(printed,
              testing::EndsWith("call method=GetFrame error=\"a \\\"b\\\"\\\\x0ac\" empty=\"\"\n"));
}

TEST(Log, JsonLinesAreObjectsWhateverTheyHold) {
  testing::internal::CaptureStderr();
  StartLog("test-program", LogLevel::kInfo, LogFormat::kJson);
  Log(LogLevel::kDebug, "too low");
  Log(LogLevel::kWarning, "line\nbreak", {{"principal", "\"me\""}, {"odd", "\xFF"}});
  const std::string printed = testing::internal::GetCapturedStderr();
  EXPECT_THAT(printed, testing::MatchesRegex("\\{\"time\":\"[-0-9T:.]+Z\",\"program\":"
                                             "\"test-program\",\"pid\":[0-9]+,\"level\":"
                                             "\"warning\",\"message\":\"line\\\\nbreak\","
                                             "\"principal\":\"\\\\\"me\\\\\"\","
                                             "\"odd\":\"\xEF\xBF\xBD\"\\}\n"));
}

TEST(Log, OnlyKnownFormatsAreParsed) {
  EXPECT_EQ(*ParseLogFormat("json"), LogFormat::kJson);
  EXPECT_EQ(*ParseLogFormat("text"), LogFormat::kText);
  EXPECT_FALSE(ParseLogFormat("xml").ok());
}

}  // namespace
}  // namespace liquidblend::base

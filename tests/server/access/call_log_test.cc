#include "server/access/call_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace liquidblend::server {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

class CallLogTest : public testing::Test {
 protected:
  void SetUp() override {
    base::StartLog("server", base::LogLevel::kInfo, base::LogFormat::kJson);
    testing::internal::CaptureStderr();
  }

  void TearDown() override { testing::internal::GetCapturedStderr(); }

  static EndedCall Failed(const std::string& client, const std::string& error = "no such thing") {
    EndedCall call;
    call.how = {{"method", "GetFrame"}, {"code", "NOT_FOUND"}};
    call.took = absl::Milliseconds(1.5);
    call.caller.client = client;
    call.caller.request_id = "r1";
    call.error = error;
    return call;
  }

  // What has been logged since the last look.
  static std::vector<std::string> Lines() {
    const std::string text = testing::internal::GetCapturedStderr();
    testing::internal::CaptureStderr();
    return absl::StrSplit(text, '\n', absl::SkipEmpty());
  }

  void LetTimePass() {
    for (const auto& work : std::exchange(later_, {})) work();
  }

  std::vector<std::function<void()>> later_;
  CallLog log_{[this](absl::Duration delay, std::function<void()> work) {
    EXPECT_EQ(delay, CallLog::kWindow);
    later_.push_back(std::move(work));
  }};
};

TEST_F(CallLogTest, ALineTellsAllOfACall) {
  EndedCall call = Failed("studio");
  call.caller.principal.name = "studio";
  call.resource = "families/none";
  log_.Tell(call);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr(
                           R"("message":"call","method":"GetFrame","code":"NOT_FOUND","ms":"1.5",)"
                           R"("principal":"studio","client":"studio","request_id":"r1",)"
                           R"("resource":"families/none","error":"no such thing"})")));
}

TEST_F(CallLogTest, ACallOfATraceHasItsId) {
  EndedCall call = Failed("studio");
  call.caller.span = trace::Span(
      trace::ParseContext("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"));
  log_.Tell(call);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr(
                           R"("request_id":"r1","trace_id":"4bf92f3577b34da6a3ce929d0e0e4736")")));
}

TEST_F(CallLogTest, MoreOfTheSameIsCountedInOneLine) {
  for (int i = 0; i < 1000; ++i) log_.Tell(Failed(absl::StrCat("ipv4:10.0.0.1:", i)));
  EXPECT_THAT(Lines(), SizeIs(CallLog::kMaxLines));
  ASSERT_THAT(later_, SizeIs(1));
  LetTimePass();
  EXPECT_THAT(Lines(), ElementsAre(AllOf(
                           HasSubstr(absl::StrCat(1000 - CallLog::kMaxLines, " more like this")),
                           HasSubstr(R"("method":"GetFrame","code":"NOT_FOUND")"),
                           HasSubstr(R"("client":"10.0.0.1")"))));
  log_.Tell(Failed("ipv4:10.0.0.1:7"));
  EXPECT_THAT(Lines(), SizeIs(1)) << "a second has passed";
  LetTimePass();
  EXPECT_THAT(Lines(), SizeIs(0)) << "nothing was left out";
}

TEST_F(CallLogTest, OneClientDoesNotSilenceOthers) {
  for (int i = 0; i < 100; ++i) log_.Tell(Failed("ipv4:10.0.0.1:5"));
  Lines();
  log_.Tell(Failed("ipv4:10.0.0.2:5"));
  EndedCall known = Failed("ipv4:10.0.0.1:5");
  known.caller.principal.key = "studio";
  log_.Tell(known);
  EXPECT_THAT(Lines(), SizeIs(2));
}

TEST_F(CallLogTest, WhatWentWellIsNeverLeftOut) {
  for (int i = 0; i < 100; ++i) log_.Tell(Failed("ipv4:10.0.0.1:5", ""));
  EXPECT_THAT(Lines(), SizeIs(100));
}

TEST_F(CallLogTest, TheWorstOfWhatIsLeftOutCounts) {
  for (int i = 0; i < 20; ++i) log_.Tell(Failed("ipv4:10.0.0.1:5"));
  EndedCall broken = Failed("ipv4:10.0.0.1:5");
  broken.level = base::LogLevel::kError;
  log_.Tell(broken);
  Lines();
  LetTimePass();
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr(R"("level":"error")")));
}

TEST_F(CallLogTest, ManyClientsAreCountedTogether) {
  for (int i = 0; i < 3000; ++i) {
    log_.Tell(Failed(absl::StrCat("ipv4:10.0.", i / 250, ".", i % 250, ":1")));
  }
  EXPECT_LT(Lines().size(), 1100);
  log_.Flush();
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr(R"("client":"others")")));
}

}  // namespace
}  // namespace liquidblend::server

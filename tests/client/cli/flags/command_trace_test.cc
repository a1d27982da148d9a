#include "client/cli/flags/command_trace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include "tests/core/trace/fake_collector.h"

namespace liquidblend::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using trace::CollectedSpan;

constexpr char kParent[] = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

class CommandTraceTest : public ::testing::Test {
 protected:
  ~CommandTraceTest() override {
    for (const char* name : {"OTEL_EXPORTER_OTLP_ENDPOINT", "TRACEPARENT", "TRACESTATE"}) {
      unsetenv(name);
    }
  }

  void ExportTo(const std::string& url) { setenv("OTEL_EXPORTER_OTLP_ENDPOINT", url.c_str(), 1); }

  trace::FakeCollector collector_;
  std::vector<std::string> lines_;
  CommandTrace trace_{[this](const std::string& line) { lines_.push_back(line); }};
};

TEST_F(CommandTraceTest, WithoutAnEnvironmentCallsAreInNone) {
  EXPECT_EQ(trace_.HeadersOfCall().traceparent, "");
  trace_.End("frame", absl::OkStatus());
  EXPECT_EQ(collector_.num_requests(), 0);
}

TEST_F(CommandTraceTest, WhoeverRunsTheCommandIsPassedOn) {
  setenv("TRACEPARENT", kParent, 1);
  setenv("TRACESTATE", "vendor=1", 1);
  EXPECT_EQ(trace_.HeadersOfCall().traceparent, kParent);
  EXPECT_EQ(trace_.HeadersOfCall().tracestate, "vendor=1");
  trace_.End("frame", absl::OkStatus());
}

TEST_F(CommandTraceTest, AllCallsAreWithinOneSpan) {
  ExportTo(collector_.url());
  setenv("TRACEPARENT", kParent, 1);
  const std::string first = trace_.HeadersOfCall().traceparent;
  EXPECT_EQ(trace_.HeadersOfCall().traceparent, first);
  trace_.End("frame", absl::NotFoundError("families/none does not exist"));
  const std::vector<CollectedSpan> spans = collector_.Spans();
  ASSERT_THAT(spans, SizeIs(1));
  EXPECT_EQ(spans[0].service, "liquidblend");
  EXPECT_EQ(spans[0].name, "liquidblend frame");
  EXPECT_EQ(spans[0].kind, 3);
  EXPECT_EQ(spans[0].parent_id, "00f067aa0ba902b7");
  EXPECT_EQ("00-" + spans[0].trace_id + "-" + spans[0].span_id + "-01", first);
  EXPECT_TRUE(spans[0].has_failed);
  EXPECT_EQ(spans[0].error, "families/none does not exist");
  EXPECT_EQ(spans[0].attributes.at("error.type"), "NOT_FOUND");
  EXPECT_THAT(lines_, IsEmpty());
}

TEST_F(CommandTraceTest, AMalformedParentBeginsATrace) {
  ExportTo(collector_.url());
  setenv("TRACEPARENT", "nonsense", 1);
  trace_.HeadersOfCall();
  trace_.End("list", absl::OkStatus());
  ASSERT_THAT(collector_.Spans(), SizeIs(1));
  EXPECT_EQ(collector_.Spans()[0].parent_id, "");
  EXPECT_FALSE(collector_.Spans()[0].has_failed);
}

TEST_F(CommandTraceTest, ACommandWithoutCallsHasNoSpan) {
  ExportTo(collector_.url());
  trace_.End("convert", absl::OkStatus());
  EXPECT_EQ(collector_.num_requests(), 0);
}

TEST_F(CommandTraceTest, ACollectorThatRefusesIsReported) {
  ExportTo(collector_.url());
  collector_.FailNext(1, 401);
  trace_.HeadersOfCall();
  trace_.End("frame", absl::OkStatus());
  EXPECT_THAT(lines_, ElementsAre(HasSubstr("HTTP status 401")));
}

}  // namespace
}  // namespace liquidblend::cli

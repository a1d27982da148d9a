#include "core/trace/tracer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include "tests/core/trace/fake_collector.h"

namespace liquidblend::trace {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

const SpanContext kSampled = {1, 2, 3, true, "vendor=1"};
const SpanContext kNotSampled = {1, 2, 3, false, ""};

class TracerTest : public testing::Test {
 protected:
  void Start(const Sampler& sampler = {}, double max_per_second = 0) {
    TracerOptions options = collector_.Options();
    options.sampler = sampler;
    options.queue.max_per_second = max_per_second;
    tracer_ = std::make_unique<Tracer>(options, [](const std::string&) {});
  }

  Span StartSpan(const SpanContext& parent) const {
    return tracer_->StartSpan("call", SpanKind::kServer, parent);
  }

  // All that were exported by the end.
  std::vector<CollectedSpan> Stop() {
    tracer_->Stop(absl::Minutes(1));
    return collector_.Spans();
  }

  FakeCollector collector_;
  std::unique_ptr<Tracer> tracer_;
};

TEST_F(TracerTest, ASpanWithAParentIsOfItsTrace) {
  Start();
  const Span span = StartSpan(kSampled);
  EXPECT_EQ(TraceIdOf(span.context()), TraceIdOf(kSampled));
  EXPECT_NE(span.context().span_id, kSampled.span_id);
  EXPECT_TRUE(span.context().is_sampled);
  span.End();
  const std::vector<CollectedSpan> spans = Stop();
  ASSERT_THAT(spans, SizeIs(1));
  EXPECT_EQ(spans[0].service, "test");
  EXPECT_EQ(spans[0].name, "call");
  EXPECT_EQ(spans[0].kind, 2);
  EXPECT_EQ(spans[0].parent_id, SpanIdOf(kSampled));
  EXPECT_EQ(spans[0].state, "vendor=1");
}

TEST_F(TracerTest, OneWithoutAParentBeginsATrace) {
  Start();
  const Span one = StartSpan({});
  const Span two = StartSpan({});
  EXPECT_TRUE(one.context().is_valid());
  EXPECT_NE(TraceIdOf(one.context()), TraceIdOf(two.context()));
  one.End();
  const std::vector<CollectedSpan> spans = Stop();
  ASSERT_THAT(spans, SizeIs(1));
  EXPECT_EQ(spans[0].parent_id, "");
}

TEST_F(TracerTest, TheCallersFlagDecidesUnlessTheSamplerDoes) {
  Start();
  const Span left_out = StartSpan(kNotSampled);
  EXPECT_FALSE(left_out.is_recording());
  EXPECT_EQ(ToTraceparent(left_out.context()), ToTraceparent(kNotSampled));
  Start({.ratio = 1, .by_parent = false});
  EXPECT_TRUE(StartSpan(kNotSampled).context().is_sampled);
  Start({.ratio = 0, .by_parent = false});
  const Span refused = StartSpan(kSampled);
  EXPECT_FALSE(refused.is_recording());
  EXPECT_EQ(ToTraceparent(refused.context()), ToTraceparent(kNotSampled)) << "others follow it";
}

TEST_F(TracerTest, ATraceThatIsLeftOutHasAnIdAndIsLeftOutElsewhere) {
  Start({.ratio = 0, .by_parent = true});
  const Span span = StartSpan({});
  EXPECT_FALSE(span.is_recording());
  EXPECT_TRUE(span.context().is_valid());
  EXPECT_FALSE(span.context().is_sampled);
  EXPECT_TRUE(StartSpan(kSampled).is_recording());
}

TEST_F(TracerTest, BeyondTheRateNothingIsRecordedWhateverCallersAskFor) {
  Start({}, /*max_per_second=*/0.01);
  StartSpan(kSampled).End();
  const Span foreign = StartSpan(kSampled);
  EXPECT_FALSE(foreign.is_recording());
  EXPECT_EQ(ToTraceparent(foreign.context()), ToTraceparent(kSampled));
  const Span own = StartSpan({});
  EXPECT_FALSE(own.is_recording());
  EXPECT_FALSE(own.context().is_sampled);
  EXPECT_EQ(tracer_->stats().num_over_rate, 2);
  EXPECT_THAT(Stop(), SizeIs(1));
}

TEST(IsSampled, TakesTheShareOfTracesThatTheRatioSays) {
  const Sampler quarter = {.ratio = 0.25, .by_parent = true};
  int num_sampled = 0;
  for (int k = 0; k < 10'000; ++k) {
    const SpanContext context = {RandomId(), RandomId(), 1, false, ""};
    num_sampled += IsSampled(quarter, context, /*has_parent=*/false);
  }
  EXPECT_NEAR(num_sampled, 2500, 250);            // 5 standard deviations are 217
  const uint64_t last = (uint64_t{1} << 62) - 1;  // a quarter of 2^64, by the upper 63 bits
  EXPECT_TRUE(IsSampled(quarter, {0, last, 1, false, ""}, false));
  EXPECT_FALSE(IsSampled(quarter, {0, last + 1, 1, false, ""}, false));
  EXPECT_TRUE(IsSampled({.ratio = 1}, {0, ~uint64_t{0}, 1, false, ""}, false));
}

TEST_F(TracerTest, OneThatIsOffPassesContextsOn) {
  for (const Tracer& tracer : {Tracer(), Tracer(TracerOptions(), {})}) {
    EXPECT_FALSE(tracer.is_on());
    const Span span = tracer.StartSpan("call", SpanKind::kServer, kSampled);
    EXPECT_FALSE(span.is_recording());
    EXPECT_EQ(ToTraceparent(span.context()), ToTraceparent(kSampled));
    EXPECT_FALSE(tracer.StartSpan("call", SpanKind::kServer, {}).context().is_valid());
    EXPECT_EQ(tracer.stats().num_exported, 0);
  }
}

TEST_F(TracerTest, OpensByTheEnvironmentAndReportsWhatItDoesNotUnderstand) {
  std::vector<std::string> lines;
  const Report report = [&](const std::string& line) { lines.push_back(line); };
  EXPECT_FALSE(Tracer::Open({"test", "1"}, report)->is_on());
  setenv("OTEL_EXPORTER_OTLP_ENDPOINT", collector_.url().c_str(), 1);
  setenv("OTEL_TRACES_SAMPLER", "xray", 1);
  {
    const std::unique_ptr<Tracer> tracer = Tracer::Open({"test", "1"}, report);
    tracer->StartSpan("call", SpanKind::kServer, {}).End();
    tracer->Stop(absl::Minutes(1));
  }
  unsetenv("OTEL_EXPORTER_OTLP_ENDPOINT");
  unsetenv("OTEL_TRACES_SAMPLER");
  EXPECT_THAT(lines, testing::ElementsAre(testing::HasSubstr("traces: OTEL_TRACES_SAMPLER")));
  EXPECT_THAT(collector_.Spans(), SizeIs(1));
}

}  // namespace
}  // namespace liquidblend::trace

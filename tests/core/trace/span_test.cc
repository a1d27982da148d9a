#include "core/trace/span.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/time/clock.h"

namespace liquidblend::trace {
namespace {

using testing::ElementsAre;
using testing::Pair;
using testing::SizeIs;

class SpanTest : public testing::Test {
 protected:
  Span Start(const std::string& name = "call") {
    SpanRecord record;
    record.context = {1, 2, RandomId(), true, "vendor=1"};
    record.name = name;
    record.begin = absl::Now();
    return {queue_, std::move(record)};
  }

  std::vector<SpanRecord> Ended() {
    return queue_->empty() ? std::vector<SpanRecord>() : queue_->Take(100, absl::ZeroDuration());
  }

  std::shared_ptr<SpanQueue> queue_ = std::make_shared<SpanQueue>(SpanQueueOptions());
};

TEST_F(SpanTest, KeepsWhatIsSaidUntilItEnds) {
  const Span span = Start();
  span.SetName("renamed");
  span.SetAttribute("count", int64_t{1});
  span.SetAttribute("count", int64_t{2});
  span.AddEvent("half-way", {{"share", 0.5}});
  span.SetError("broken");
  EXPECT_THAT(Ended(), SizeIs(0));
  span.End();
  span.SetAttribute("late", true);
  span.End();
  const std::vector<SpanRecord> ended = Ended();
  ASSERT_THAT(ended, SizeIs(1));
  EXPECT_EQ(ended[0].name, "renamed");
  EXPECT_THAT(ended[0].attributes, ElementsAre(Pair("count", AttributeValue(int64_t{2}))));
  ASSERT_THAT(ended[0].events, SizeIs(1));
  EXPECT_EQ(ended[0].events[0].name, "half-way");
  EXPECT_TRUE(ended[0].has_failed);
  EXPECT_EQ(ended[0].error, "broken");
  EXPECT_GE(ended[0].end, ended[0].begin);
  EXPECT_EQ(ended[0].context.span_id, span.context().span_id);
}

TEST_F(SpanTest, EndsWithItsLastHandle) {
  {
    const Span copy = Start();
    const Span other = copy;
  }
  EXPECT_THAT(Ended(), SizeIs(1));
}

TEST_F(SpanTest, ChildrenAreOfItsTraceAndMayOutliveIt) {
  const Span span = Start();
  const Span child = span.StartChild("stage");
  const absl::Time begin = absl::FromUnixSeconds(1'700'000'000);
  span.End();
  span.RecordChild("write", begin, begin + absl::Seconds(2));
  child.StartChild("part").End();
  child.End();
  const std::vector<SpanRecord> ended = Ended();
  ASSERT_THAT(ended, SizeIs(4));
  EXPECT_EQ(ended[1].name, "write");
  EXPECT_EQ(ended[1].end - ended[1].begin, absl::Seconds(2));
  EXPECT_EQ(ended[1].parent_id, span.context().span_id);
  EXPECT_EQ(ended[2].name, "part");
  EXPECT_EQ(ended[2].parent_id, child.context().span_id);
  EXPECT_EQ(ended[3].parent_id, span.context().span_id);
  for (const SpanRecord& one : ended) {
    EXPECT_EQ(TraceIdOf(one.context), TraceIdOf(span.context()));
    EXPECT_EQ(one.context.state, "vendor=1");
  }
}

TEST_F(SpanTest, WhatIsSaidIsBounded) {
  const Span span = Start();
  for (size_t k = 0; k < Span::kMaxAttributes + 5; ++k) {
    span.SetAttribute(std::to_string(k), std::string(10'000, 'a'));
  }
  for (size_t k = 0; k < Span::kMaxEvents + 7; ++k) {
    span.AddEvent("event", Attributes(100, {"name", std::string(10'000, 'a')}));
  }
  span.SetError(std::string(10'000, 'a'));
  span.End();
  const SpanRecord ended = Ended().at(0);
  EXPECT_THAT(ended.attributes, SizeIs(Span::kMaxAttributes));
  EXPECT_EQ(ended.num_dropped_attributes, 5);
  EXPECT_EQ(std::get<std::string>(ended.attributes[0].second).size(), Span::kMaxTextBytes);
  EXPECT_THAT(ended.events, SizeIs(Span::kMaxEvents));
  EXPECT_EQ(ended.num_dropped_events, 7);
  EXPECT_THAT(ended.events[0].attributes, SizeIs(Span::kMaxEventAttributes));
  EXPECT_EQ(ended.error.size(), Span::kMaxTextBytes);
}

TEST_F(SpanTest, OneThatIsNotRecordedOnlyPassesItsContextOn) {
  const SpanContext context = {1, 2, 3, false, "vendor=1"};
  for (const Span& span : {Span(), Span(context)}) {
    EXPECT_FALSE(span.is_recording());
    span.SetName("name");
    span.SetAttribute("name", true);
    span.AddEvent("event");
    span.SetError("error");
    span.RecordChild("child", absl::Now(), absl::Now());
    EXPECT_EQ(ToTraceparent(span.StartChild("child").context()), ToTraceparent(span.context()));
    span.End();
  }
  EXPECT_FALSE(Span().context().is_valid());
  EXPECT_FALSE(Span(SpanContext()).context().is_valid());
  EXPECT_EQ(Span(context).context().state, "vendor=1");
  EXPECT_EQ(queue_->stats().num_dropped(), 0);
}

}  // namespace
}  // namespace liquidblend::trace

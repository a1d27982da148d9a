#include "core/trace/span_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>

namespace liquidblend::trace {
namespace {

SpanRecord Named(const std::string& name) {
  SpanRecord span;
  span.name = name;
  return span;
}

SpanQueueOptions Options(size_t max_spans, double max_per_second = 0) {
  SpanQueueOptions options;
  options.max_spans = max_spans;
  options.max_per_second = max_per_second;
  return options;
}

std::vector<std::string> NamesOf(const std::vector<SpanRecord>& spans) {
  std::vector<std::string> names;
  for (const SpanRecord& span : spans) names.push_back(span.name);
  return names;
}

TEST(SpanQueue, GivesSpansInOrderAndInBatches) {
  SpanQueue queue(Options(10));
  for (const char* name : {"a", "b", "c"}) queue.Push(Named(name));
  EXPECT_THAT(NamesOf(queue.Take(2, absl::InfiniteDuration())), testing::ElementsAre("a", "b"));
  EXPECT_THAT(NamesOf(queue.Take(2, absl::ZeroDuration())), testing::ElementsAre("c"));
  EXPECT_TRUE(queue.empty());
}

TEST(SpanQueue, DropsAndCountsWhatIsTooMuch) {
  SpanQueue queue(Options(2));
  for (const char* name : {"a", "b", "c", "d"}) queue.Push(Named(name));
  EXPECT_EQ(queue.stats().num_over_queue, 2);
  EXPECT_EQ(queue.stats().num_dropped(), 2);
  // A full queue is a batch, even if that is smaller than the batch wanted.
  EXPECT_THAT(NamesOf(queue.Take(512, absl::InfiniteDuration())), testing::ElementsAre("a", "b"));
}

TEST(SpanQueue, ClosingEndsAWait) {
  SpanQueue queue(Options(10));
  std::thread taker([&] { EXPECT_TRUE(queue.Take(2, absl::InfiniteDuration()).empty()); });
  queue.Close();
  taker.join();
  queue.Push(Named("late"));
  EXPECT_TRUE(queue.empty());
  queue.Pause(absl::InfiniteDuration());
}

TEST(SpanQueue, AdmitsNoMoreThanTheRate) {
  constexpr double kRate = 0.1;  // one in ten seconds; a second's worth is less than one span
  SpanQueue slow(Options(10, kRate));
  EXPECT_TRUE(slow.Admit());
  EXPECT_FALSE(slow.Admit());
  EXPECT_FALSE(slow.Admit());
  EXPECT_EQ(slow.stats().num_over_rate, 2);
}

TEST(SpanQueue, ChildrenCountWithoutBeingRefused) {
  SpanQueue queue(Options(10, 5));
  EXPECT_TRUE(queue.Admit());
  for (int k = 0; k < 1000; ++k) queue.Charge();
  EXPECT_FALSE(queue.Admit());
}

TEST(SpanQueue, ARateOf0IsNone) {
  SpanQueue queue(Options(10, 0));
  for (int k = 0; k < 1000; ++k) {
    EXPECT_TRUE(queue.Admit());
    queue.Charge();
  }
}

}  // namespace
}  // namespace liquidblend::trace

#include "server/frames/frame_maker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "tests/synthetic/families.h"

namespace liquidblend::server {
namespace {

// A pool of one thread that makes nothing before Release().
class FrameMakerTest : public testing::Test {
 protected:
  FrameMakerTest()
      : cache_(1 << 20),
        pool_(1, {.max_waiting_cost = 1'000'000, .quantum = 1}),
        maker_(cache_, pool_, buffer_pool_, uses_, metrics_) {
    mesh::RegisteredFamily family = synthetic::MakeFamily(
        synthetic::MixedSphere(2), {{synthetic::SmoothWarp(1, 0.1F, 0.3F), {}}});
    family.name = "drops";
    family_ = std::make_shared<catalog::LoadedFamily>(std::move(family), std::nullopt);
    absl::Notification begun;
    EXPECT_TRUE(pool_
                    .Post({"other", false, 1, absl::ZeroDuration(),
                           [&] {
                             begun.Notify();
                             release_.WaitForNotification();
                           }},
                          false)
                    .ok());
    begun.WaitForNotification();
  }
  ~FrameMakerTest() override { Release(); }

  void Release() {
    if (!release_.HasBeenNotified()) release_.Notify();
    pool_.Stop();
  }

  FrameOrder Order(double weight, const std::string& client = "a") {
    FrameOrder order;
    order.loaded = family_;
    order.query.weights = {weight};
    order.client = client;
    return order;
  }

  // What `done` got.
  struct Answer {
    std::optional<absl::StatusOr<FramePtr>> result;
    FrameMaker::Done Done() {
      return [this](absl::StatusOr<FramePtr> made) { result = std::move(made); };
    }
    FramePtr frame() const { return result.has_value() && result->ok() ? **result : nullptr; }
  };

  std::shared_ptr<const catalog::LoadedFamily> family_;
  absl::Notification release_;
  FrameCache cache_;
  FrameBufferPool buffer_pool_;
  catalog::FamilyUses uses_;
  metrics::Metrics metrics_;
  FramePool pool_;
  FrameMaker maker_;
};

TEST_F(FrameMakerTest, AFrameIsMadeOnceForAllThatWait) {
  Answer first, second, other;
  maker_.Make(Order(0.5, "a"), first.Done());
  maker_.Make(Order(0.5, "b"), second.Done());
  maker_.Make(Order(0.25, "a"), other.Done());
  Release();
  ASSERT_NE(first.frame(), nullptr);
  EXPECT_EQ(first.frame(), second.frame());  // the same bytes in memory
  ASSERT_NE(other.frame(), nullptr);
  EXPECT_NE(*first.frame(), *other.frame());
  v1::Frame frame;
  ASSERT_TRUE(frame.ParseFromString(*first.frame()));
  EXPECT_EQ(frame.data().substr(0, 5), "DRACO");
}

TEST_F(FrameMakerTest, EveryCallThatWaitsHasTheStagesInItsSpan) {
  const auto queue = std::make_shared<trace::SpanQueue>(trace::SpanQueueOptions());
  const auto order_with_span = [&](uint64_t id, const std::string& client) {
    FrameOrder order = Order(0.5, client);
    trace::SpanRecord record;
    record.context = {1, 2, id, true, ""};
    record.name = absl::StrCat(id);
    order.span = trace::Span(queue, std::move(record));
    return order;
  };
  Answer first, second, cached;
  maker_.Make(order_with_span(1, "a"), first.Done());
  maker_.Make(order_with_span(2, "b"), second.Done());
  Release();
  ASSERT_NE(first.frame(), nullptr);
  maker_.Make(order_with_span(3, "a"), cached.Done());
  std::map<uint64_t, std::set<std::string>> stages;  // by their parent
  std::map<std::string, std::string> sources;        // by the call
  for (const trace::SpanRecord& span : queue->Take(100, absl::ZeroDuration())) {
    if (span.parent_id != 0) stages[span.parent_id].insert(span.name);
    for (const auto& [name, value] : span.attributes) {
      if (name == "liquidblend.frame.source") sources[span.name] = std::get<std::string>(value);
    }
  }
  for (const uint64_t id : {1, 2}) {
    EXPECT_THAT(stages[id], testing::IsSupersetOf({"queue", "slice", "encode"})) << id;
  }
  EXPECT_FALSE(stages.contains(3));
  const std::map<std::string, std::string> expected = {
      {"1", "made"}, {"2", "made"}, {"3", "cache"}};
  EXPECT_EQ(sources, expected);
}

TEST_F(FrameMakerTest, ACallThatThrowsDoesNotKeepTheFrameFromOthers) {
  Answer second, later;
  maker_.Make(Order(0.5, "a"), [](const absl::StatusOr<FramePtr>&) { throw std::bad_alloc(); });
  maker_.Make(Order(0.5, "b"), second.Done());
  Release();
  ASSERT_NE(second.frame(), nullptr);
  maker_.Make(Order(0.5, "b"), later.Done());
  EXPECT_EQ(later.frame(), second.frame());
}

TEST_F(FrameMakerTest, AFrameThatIsKeptIsAnsweredAtOnce) {
  const FramePtr kept = std::make_shared<const std::string>("kept");
  cache_.Insert(KeyOf(*family_, Order(0.5).query), kept);
  Answer answer;
  EXPECT_EQ(maker_.Make(Order(0.5), answer.Done()), nullptr);
  EXPECT_EQ(answer.frame(), kept);
}

TEST_F(FrameMakerTest, WhatIsMadeIsKept) {
  Answer answer;
  maker_.Make(Order(0.5), answer.Done());
  Release();
  EXPECT_EQ(cache_.Find(KeyOf(*family_, Order(0.5).query)), answer.frame());
}

TEST_F(FrameMakerTest, WhoLeavesDoesNotTakeTheFrameFromTheOthers) {
  Answer first, second;
  const FrameMaker::Ticket ticket = maker_.Make(Order(0.5, "a"), first.Done());
  maker_.Make(Order(0.5, "b"), second.Done());
  maker_.Leave(ticket);
  Release();
  EXPECT_FALSE(first.result.has_value());
  EXPECT_NE(second.frame(), nullptr);
}

TEST_F(FrameMakerTest, AFrameThatNobodyWaitsForIsNotMade) {
  Answer answer;
  maker_.Leave(maker_.Make(Order(0.5), answer.Done()));
  EXPECT_EQ(pool_.stats().waiting_cost, 0);
  Release();
  EXPECT_FALSE(answer.result.has_value());
  EXPECT_EQ(cache_.stats().num_frames, 0);
}

TEST_F(FrameMakerTest, WhoAsksAgainAfterTheLastHasLeftGetsAFrame) {
  Answer first, second;
  maker_.Leave(maker_.Make(Order(0.5), first.Done()));
  maker_.Make(Order(0.5), second.Done());
  Release();
  EXPECT_NE(second.frame(), nullptr);
}

TEST_F(FrameMakerTest, ARefusalReachesOnlyTheOneThatIsRefused) {
  Answer waits, refused, joins;
  FrameOrder large = Order(0.5, "a");
  maker_.Make(large, waits.Done());
  while (pool_.stats().num_refused == 0) {  // fill a's part
    FrameOrder more = Order(0.5, "a");
    more.query.weights = {static_cast<double>(pool_.stats().waiting_cost) / 1e7};
    maker_.Make(more, refused.Done());
  }
  EXPECT_EQ(refused.result->status().code(), absl::StatusCode::kResourceExhausted);
  maker_.Make(Order(0.5, "b"), joins.Done());
  Release();
  EXPECT_NE(waits.frame(), nullptr);
  EXPECT_EQ(joins.frame(), waits.frame());
}

TEST_F(FrameMakerTest, AnErrorReachesAllAndIsNotKept) {
  Answer first, second;
  FrameOrder order = Order(0.5);
  order.query.time_s = 1e9;
  maker_.Make(order, first.Done());
  maker_.Make(order, second.Done());
  Release();
  EXPECT_EQ(first.result->status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(second.result->status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(cache_.stats().num_frames, 0);
}

TEST_F(FrameMakerTest, AStoppedFrameBreaksOff) {
  const std::atomic<bool> stop = true;
  FrameBuffers buffers;
  buffers.surface.stop = &stop;
  EXPECT_EQ(MakeFrame(*family_, Order(0.5).query, buffers).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace liquidblend::server

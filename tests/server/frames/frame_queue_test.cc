#include "server/frames/frame_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

namespace liquidblend::server {
namespace {

using testing::HasSubstr;

constexpr FrameQueueOptions kStrict = {.max_waiting_cost = 1000, .quantum = 1};

FrameWork Work(const std::string& client, int64_t cost, int deadline_ms = 0) {
  return {client, false, cost, absl::Milliseconds(deadline_ms), [] {}};
}

// Of a connection, the first of its host's or a later one.
FrameWork PacedWorkFrom(const std::string& host, int connection, int64_t cost) {
  return {host + std::to_string(connection), true,  cost,
          absl::Milliseconds(connection),    [] {}, host};
}

FrameWork PacedWork(const std::string& client, int64_t cost, int deadline_ms) {
  return {client, true, cost, absl::Milliseconds(deadline_ms), [] {}};
}

TEST(FrameQueue, OneClientsWorkIsDoneByDeadlineThenInItsOrder) {
  FrameQueue queue(kStrict);
  queue.Push(Work("a", 1, 20));
  queue.Push(Work("a", 2, 10));
  queue.Push(Work("a", 3, 20));
  EXPECT_EQ(queue.Pop().cost, 2);
  EXPECT_EQ(queue.Pop().cost, 1);
  EXPECT_EQ(queue.Pop().cost, 3);
  EXPECT_TRUE(queue.empty());
}

TEST(FrameQueue, ClientsGetEqualSharesOfCostHoweverManyTheyAsk) {
  FrameQueue queue({.max_waiting_cost = 1'000'000, .quantum = 1});
  for (int k = 0; k < 100; ++k) queue.Push(Work("many", 10));
  for (int k = 0; k < 10; ++k) queue.Push(Work("few", 30));
  std::map<std::string, int64_t> served;
  for (int k = 0; k < 28; ++k) {
    const FrameWork work = queue.Pop();
    served[work.client] += work.cost;
  }
  EXPECT_NEAR(static_cast<double>(served["many"]), static_cast<double>(served["few"]), 30);
}

TEST(FrameQueue, AnAbsentClientIsOwedNothing) {
  FrameQueue queue(kStrict);
  for (int k = 0; k < 20; ++k) queue.Push(Work("busy", 10, k));
  for (int k = 0; k < 10; ++k) queue.Pop();
  for (int k = 0; k < 10; ++k) queue.Push(Work("late", 10, k));
  int num_late = 0;
  for (int k = 0; k < 10; ++k) num_late += queue.Pop().client == "late" ? 1 : 0;
  EXPECT_NEAR(num_late, 5, 1);
}

TEST(FrameQueue, UrgentWorkGoesFirstWithinAQuantum) {
  FrameQueue queue({.max_waiting_cost = 1000, .quantum = 25});
  for (int k = 0; k < 10; ++k) queue.Push(Work("urgent", 10, k));
  for (int k = 0; k < 10; ++k) queue.Push(Work("patient", 10, 100));
  std::string order;
  for (int k = 0; k < 8; ++k) order += queue.Pop().client[0];
  // Ahead by a quantum, then in turns.
  EXPECT_EQ(order, "uuupupup");
}

TEST(FrameQueue, AStreamWithinItsShareNeverWaitsForAFloodOfCalls) {
  FrameQueue queue({.max_waiting_cost = 1'000'000, .quantum = 20});
  for (int k = 0; k < 1000; ++k) queue.Push(Work("flood", 10, 100));
  for (int frame = 0; frame < 50; ++frame) {
    queue.Push(PacedWork("stream", 10, 16 * frame));
    EXPECT_EQ(queue.Pop().client, "stream") << frame;
    for (int k = 0; k < 3; ++k) EXPECT_EQ(queue.Pop().client, "flood");
  }
}

TEST(FrameQueue, AClientsOwnCallsDoNotMakeItsStreamsLateNorTheOtherWayRound) {
  FrameQueue queue({.max_waiting_cost = 1'000'000, .quantum = 20});
  for (int k = 0; k < 1000; ++k) queue.Push(Work("one", 10, 0));
  for (int k = 0; k < 1000; ++k) queue.Push(PacedWork("one", 10, 1000 + k));
  int num_paced = 0;
  for (int k = 0; k < 100; ++k) {
    const bool is_paced = queue.Pop().is_paced;
    num_paced += is_paced ? 1 : 0;
    EXPECT_TRUE(is_paced || k > 0);
  }
  EXPECT_NEAR(num_paced, 50, 3);
}

TEST(FrameQueue, OfTwoLateStreamsTheEarlierOneGoesFirst) {
  FrameQueue queue({.max_waiting_cost = 1000, .quantum = 20});
  queue.Push(PacedWork("a", 10, 30));
  queue.Push(PacedWork("b", 10, 20));
  queue.Push(Work("c", 10, 0));
  EXPECT_EQ(queue.Pop().client, "b");
  EXPECT_EQ(queue.Pop().client, "a");
  EXPECT_EQ(queue.Pop().client, "c");
}

// Both streams ask for more than their share, the caller for less.
TEST(FrameQueue, WhoAsksForLessThanItsShareGoesBeforeThoseThatAskForMore) {
  FrameQueue queue({.max_waiting_cost = 1'000'000, .quantum = 40});
  queue.Push(Work("caller", 10));
  queue.Pop();
  for (int k = 0; k < 1000; ++k) {
    queue.Push(PacedWork("a", 10, k));
    queue.Push(PacedWork("b", 10, k));
  }
  for (int call = 0; call < 50; ++call) {
    for (int k = 0; k < 20; ++k) EXPECT_TRUE(queue.Pop().is_paced);
    queue.Push(Work("caller", 10));
    EXPECT_EQ(queue.Pop().client, "caller") << call;
  }
  // More than that is no longer less than its share.
  for (int k = 0; k < 100; ++k) queue.Push(Work("caller", 10));
  int num_calls = 0;
  for (int k = 0; k < 99; ++k) num_calls += queue.Pop().is_paced ? 0 : 1;
  EXPECT_NEAR(num_calls, 33, 8);
}

// The stream stands at 210 then, the round at 200; 40 of the caller's 80 make it as urgent.
TEST(FrameQueue, WhoComesBackIsOwedTwoQuanta) {
  FrameQueue queue({.max_waiting_cost = 1'000'000, .quantum = 40});
  queue.Push(Work("caller", 10));
  queue.Pop();
  for (int k = 0; k < 100; ++k) queue.Push(PacedWork("stream", 10, k));
  for (int k = 0; k < 20; ++k) queue.Pop();
  for (int k = 0; k < 100; ++k) queue.Push(Work("caller", 10));
  int num_calls = 0;
  while (!queue.Pop().is_paced) ++num_calls;
  EXPECT_EQ(num_calls, 5);
}

TEST(FrameQueue, RemembersManyAccountsAndForgetsThoseThatOweNothing) {
  FrameQueue queue({.max_waiting_cost = 1'000'000, .quantum = 20});
  const auto serve = [&](const std::string& client) {
    queue.Push(Work(client, 10));
    return queue.Pop().client;
  };
  for (int k = 0; k < 10'000; ++k) EXPECT_EQ(serve(std::to_string(k)), std::to_string(k));
  EXPECT_LE(queue.num_accounts(), 5'000U);
}

TEST(FrameQueue, NobodyGetsAheadByNewConnections) {
  FrameQueue queue({.max_waiting_cost = 1'000'000, .quantum = 20});
  for (int k = 0; k < 100; ++k) queue.Push(Work("patient", 10));
  int num_connections = 0;
  queue.Push(PacedWorkFrom("host", num_connections++, 10));
  for (int k = 0; k < 100; ++k) {
    if (queue.Pop().is_paced) queue.Push(PacedWorkFrom("host", num_connections++, 10));
  }
  EXPECT_NEAR(num_connections, 50, 4);
}

TEST(FrameQueue, ConnectionsOfAHostThatHaveWorkOweNothingForEachOther) {
  FrameQueue queue({.max_waiting_cost = 1'000'000, .quantum = 1});
  for (int k = 0; k < 20; ++k) queue.Push(PacedWorkFrom("host", 0, 10));
  for (int k = 0; k < 10; ++k) queue.Pop();
  for (int k = 0; k < 10; ++k) queue.Push(PacedWorkFrom("host", 1, 10));
  int num_late = 0;
  for (int k = 0; k < 10; ++k) num_late += queue.Pop().client == "host1" ? 1 : 0;
  EXPECT_NEAR(num_late, 5, 1);
}

TEST(FrameQueue, RefusesWhoHasHadItsPartWhenFull) {
  FrameQueue queue(kStrict);
  EXPECT_TRUE(
      queue.HasRoomFor(Work("a", 5000)));  // nothing waits: the largest frame must be possible
  for (int k = 0; k < 10; ++k) {
    ASSERT_TRUE(queue.HasRoomFor(Work("a", 100)));
    queue.Push(Work("a", 100));
  }
  EXPECT_FALSE(queue.HasRoomFor(Work("a", 1)));
  EXPECT_TRUE(queue.HasRoomFor(Work("b", 500)));  // one of two
  EXPECT_FALSE(queue.HasRoomFor(Work("b", 501)));
  queue.Pop();
  EXPECT_TRUE(queue.HasRoomFor(Work("a", 100)));
}

TEST(FrameQueue, RemovedWorkIsNeitherDoneNorCounted) {
  FrameQueue queue(kStrict);
  const FrameQueue::Place first = queue.Push(Work("a", 7));
  queue.Push(Work("b", 5));
  EXPECT_EQ(queue.waiting_cost(), 12);
  ASSERT_TRUE(queue.Remove(first).has_value());
  EXPECT_FALSE(queue.Remove(first).has_value());
  EXPECT_EQ(queue.waiting_cost(), 5);
  EXPECT_EQ(queue.Pop().client, "b");
  EXPECT_TRUE(queue.empty());
}

TEST(FrameQueueOptions, NamesTheFirstFieldOutOfRange) {
  EXPECT_TRUE(FrameQueueOptions().Validate().ok());
  FrameQueueOptions options;
  options.quantum = 0;
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("quantum is 0"));
  options.max_waiting_cost = 0;
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("max_waiting_cost is 0"));
}

}  // namespace
}  // namespace liquidblend::server

#include "server/base/work_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <stdexcept>
#include <vector>

#include "absl/synchronization/notification.h"

namespace liquidblend::server {
namespace {

// Keeps the only thread of a pool busy until Open(). To be declared before the pool, whose thread
// may be slow to notice.
class Gate {
 public:
  void Close(WorkPool& pool) {
    ASSERT_TRUE(pool.PostMore([this] {
      begun_.Notify();
      is_open_.WaitForNotification();
    }));
    begun_.WaitForNotification();
  }
  void Open() { is_open_.Notify(); }

 private:
  absl::Notification begun_, is_open_;
};

TEST(WorkPool, OneThreadRunsTasksInTheirOrder) {
  std::vector<int> order;
  WorkPool pool(1, 100);
  for (int k = 0; k < 20; ++k) {
    ASSERT_TRUE(pool.Post([&order, k] { order.push_back(k); }).ok());
  }
  pool.Stop();
  ASSERT_EQ(order.size(), 20U);
  for (int k = 0; k < 20; ++k) EXPECT_EQ(order[k], k);
}

TEST(WorkPool, RefusesNewWorkWhenTooMuchWaitsButGoesOnWithOld) {
  Gate gate;
  std::atomic<int> num_run = 0;
  WorkPool pool(1, 2);
  gate.Close(pool);
  EXPECT_TRUE(pool.Post([&] { ++num_run; }).ok());
  EXPECT_TRUE(pool.Post([&] { ++num_run; }).ok());
  EXPECT_EQ(pool.Post([&] { ++num_run; }).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(pool.PostMore([&] { ++num_run; }));
  gate.Open();
  pool.Stop();
  EXPECT_EQ(num_run, 3);
}

TEST(WorkPool, LaterTasksRunWhenTheyAreDueEarliestFirst) {
  std::vector<int> order;
  absl::Notification done;
  Gate gate;
  WorkPool pool(1, 10);
  gate.Close(pool);
  EXPECT_TRUE(pool.PostAfter(absl::Seconds(1), [&] {
    order.push_back(2);
    done.Notify();
  }));
  EXPECT_TRUE(pool.PostAfter(absl::Milliseconds(5), [&] { order.push_back(1); }));
  EXPECT_TRUE(pool.PostMore([&] { order.push_back(0); }));
  gate.Open();
  done.WaitForNotification();
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2}));
}

TEST(WorkPool, AfterStopEverythingIsRefusedAndLaterTasksAreDropped) {
  std::atomic<bool> has_run = false;
  WorkPool pool(2, 10);
  EXPECT_TRUE(pool.PostAfter(absl::Hours(1), [&] { has_run = true; }));
  pool.Stop();
  EXPECT_EQ(pool.Post([] {}).code(), absl::StatusCode::kUnavailable);
  EXPECT_FALSE(pool.PostMore([] {}));
  EXPECT_FALSE(pool.PostAfter(absl::ZeroDuration(), [] {}));
  EXPECT_FALSE(has_run);
}

// Adding these to the clock's time used to overflow, which made them due at once.
TEST(WorkPool, DelaysOfAnySizeAreSafe) {
  std::atomic<int> num_early = 0;
  absl::Notification done;
  WorkPool pool(1, 10);
  for (const absl::Duration delay : {absl::InfiniteDuration(), absl::Seconds(1e10),
                                     absl::Hours(24 * 365 * 290), WorkPool::kMaxDelay}) {
    EXPECT_TRUE(pool.PostAfter(delay, [&] { ++num_early; }));
  }
  EXPECT_TRUE(pool.PostAfter(-absl::InfiniteDuration(), [] {}));
  EXPECT_TRUE(pool.PostAfter(absl::Milliseconds(5), [&] { done.Notify(); }));
  done.WaitForNotification();
  EXPECT_EQ(num_early, 0);
  EXPECT_EQ(pool.num_timers(), 4);
}

TEST(WorkPool, ACancelledTimerIsGone) {
  std::atomic<bool> has_run = false;
  absl::Notification done;
  Gate gate;
  WorkPool pool(1, 10);
  gate.Close(pool);
  const auto timer = pool.StartTimer(absl::Milliseconds(5), [&] { has_run = true; });
  ASSERT_TRUE(timer.has_value());
  pool.Cancel(*timer);
  pool.Cancel(*timer);
  EXPECT_TRUE(pool.PostAfter(absl::Milliseconds(20), [&] { done.Notify(); }));
  EXPECT_EQ(pool.num_timers(), 1);
  gate.Open();
  done.WaitForNotification();
  EXPECT_FALSE(has_run);
}

TEST(WorkPool, ATaskThatThrowsDoesNotEndTheThread) {
  absl::Notification done;
  WorkPool pool(1, 10);
  EXPECT_TRUE(pool.PostMore([] { throw std::bad_alloc(); }));
  EXPECT_TRUE(pool.PostMore([] { throw std::runtime_error("thrown by the test"); }));
  EXPECT_TRUE(pool.PostMore([&] { done.Notify(); }));
  done.WaitForNotification();
}

}  // namespace
}  // namespace liquidblend::server

#include "server/rpc/work_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

#include "absl/synchronization/notification.h"

namespace liquidblend::rpc {
namespace {

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
  absl::Notification begun;
  absl::Notification go_on;
  std::atomic<int> num_run = 0;
  WorkPool pool(1, 2);
  ASSERT_TRUE(pool.Post([&] {
                    begun.Notify();
                    go_on.WaitForNotification();
                  })
                  .ok());
  begun.WaitForNotification();
  EXPECT_TRUE(pool.Post([&] { ++num_run; }).ok());
  EXPECT_TRUE(pool.Post([&] { ++num_run; }).ok());
  EXPECT_EQ(pool.Post([&] { ++num_run; }).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(pool.PostMore([&] { ++num_run; }));
  go_on.Notify();
  pool.Stop();
  EXPECT_EQ(num_run, 3);
}

TEST(WorkPool, LaterTasksRunWhenTheyAreDueEarliestFirst) {
  std::vector<int> order;
  absl::Notification done;
  WorkPool pool(1, 10);
  EXPECT_TRUE(pool.PostAfter(absl::Milliseconds(20), [&] {
    order.push_back(2);
    done.Notify();
  }));
  EXPECT_TRUE(pool.PostAfter(absl::Milliseconds(5), [&] { order.push_back(1); }));
  EXPECT_TRUE(pool.PostMore([&] { order.push_back(0); }));
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

}  // namespace
}  // namespace liquidblend::rpc

#include "server/frames/frame_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "absl/synchronization/barrier.h"
#include "absl/synchronization/notification.h"
#include "google/rpc/error_details.pb.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

// A pool of one thread that is busy until Release().
class FramePoolTest : public testing::Test {
 protected:
  FramePoolTest() : pool_(1, {.max_waiting_cost = 100, .quantum = 1}) {
    absl::Notification begun;
    EXPECT_TRUE(Post("first", 1, [&] {
                  begun.Notify();
                  release_.WaitForNotification();
                }).ok());
    begun.WaitForNotification();
  }

  absl::StatusOr<FrameQueue::Place> Post(const std::string& client, int64_t cost,
                                         absl::AnyInvocable<void()> run, bool is_refusable = true) {
    return pool_.Post({client, false, cost, absl::ZeroDuration(), std::move(run)}, is_refusable);
  }

  ~FramePoolTest() override { Release(); }

  void Release() {
    if (!release_.HasBeenNotified()) release_.Notify();
  }

  absl::Notification release_;
  FramePool pool_;
};

TEST_F(FramePoolTest, WorkThatThrowsDoesNotEndTheThread) {
  absl::Notification done;
  ASSERT_TRUE(Post("a", 1, [] { throw std::bad_alloc(); }).ok());
  ASSERT_TRUE(Post("a", 1, [&] { done.Notify(); }).ok());
  Release();
  done.WaitForNotification();
}

TEST_F(FramePoolTest, WhatIsFullSaysWhenToTryAgain) {
  int num_run = 0;
  ASSERT_TRUE(Post("a", 100, [&] { ++num_run; }).ok());
  const absl::Status full = Post("a", 100, [&] { ++num_run; }).status();
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  google::rpc::RetryInfo retry;
  const absl::optional<absl::Cord> payload = full.GetPayload(kRetryInfoUrl);
  ASSERT_TRUE(payload.has_value());
  ASSERT_TRUE(retry.ParseFromString(std::string(*payload)));
  EXPECT_GT(retry.retry_delay().seconds() + retry.retry_delay().nanos(), 0);
  EXPECT_EQ(pool_.stats().num_refused, 1);
  EXPECT_TRUE(Post(
                  "a", 100, [&] { ++num_run; }, false)
                  .ok());
  Release();
  pool_.Stop();
  EXPECT_EQ(num_run, 2);
}

TEST_F(FramePoolTest, CancelledWorkIsNotDone) {
  std::vector<int> done;
  ASSERT_TRUE(Post("a", 1, [&] { done.push_back(1); }).ok());
  const auto second = Post("a", 1, [&] { done.push_back(2); });
  ASSERT_TRUE(second.ok());
  pool_.Cancel(*second);
  EXPECT_EQ(pool_.stats().waiting_cost, 1);
  Release();
  pool_.Stop();
  EXPECT_EQ(done, std::vector<int>{1});
}

TEST_F(FramePoolTest, AfterStopEverythingIsRefused) {
  Release();
  pool_.Stop();
  EXPECT_EQ(Post("a", 1, [] {}).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Post(
                "a", 1, [] {}, false)
                .status()
                .code(),
            absl::StatusCode::kUnavailable);
}

// Waits until so many threads of the pool have nothing to do.
void WaitUntilIdle(const FramePool& pool, int num_threads) {
  while (pool.num_idle() < num_threads) std::this_thread::yield();
}

TEST(FramePoolHelpers, IdleThreadsTakeTasks) {
  FramePool pool(2, {});
  WaitUntilIdle(pool, 2);
  absl::Barrier* const both = new absl::Barrier(3);  // the pool's and this one, at once
  std::vector<int> num_runs(3);
  pool.Run(3, [&](int k) {
    ++num_runs[k];
    if (both->Block()) delete both;
  });
  EXPECT_EQ(num_runs, std::vector<int>({1, 1, 1}));
}

TEST_F(FramePoolTest, WhoSharesAloneDoesItAll) {
  const std::thread::id caller = std::this_thread::get_id();
  EXPECT_EQ(pool_.num_idle(), 0);
  int num_run = 0;
  pool_.Run(5, [&](int k) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_EQ(k, num_run++);
  });
  EXPECT_EQ(num_run, 5);
}

TEST(FramePoolHelpers, WhatATaskThrowsIsThrownWhenAllAreDone) {
  FramePool pool(2, {});
  WaitUntilIdle(pool, 2);
  std::atomic<int> num_run = 0;
  EXPECT_THROW(pool.Run(20,
                        [&](int k) {
                          ++num_run;
                          if (k % 7 == 0) throw std::bad_alloc();
                        }),
               std::bad_alloc);
  EXPECT_EQ(num_run, 20);
}

TEST_F(FramePoolTest, WorkOfTheQueueGoesBeforeTasks) {
  const std::thread::id caller = std::this_thread::get_id();
  absl::Notification worked;
  std::atomic<bool> is_helped_before = false;
  ASSERT_TRUE(Post("a", 1, [&] { worked.Notify(); }).ok());
  pool_.Run(2, [&](int) {
    if (std::this_thread::get_id() != caller) {
      is_helped_before = !worked.HasBeenNotified();
      return;
    }
    Release();
    worked.WaitForNotification();
  });
  EXPECT_FALSE(is_helped_before);
}

}  // namespace
}  // namespace liquidblend::server

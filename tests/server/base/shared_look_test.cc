#include "server/base/shared_look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "absl/synchronization/blocking_counter.h"
#include "absl/synchronization/notification.h"

namespace liquidblend::server {
namespace {

constexpr absl::Duration kLong = absl::Hours(1);

class SharedLookTest : public testing::Test {
 protected:
  using StringLook = SharedLook<std::string>;

  std::shared_ptr<StringLook> Make(absl::Duration kept, absl::Duration limit) {
    return std::make_shared<StringLook>(
        lookers_, timers_, [this] { return Look(); }, SharedLookOptions{"the store", kept, limit});
  }

  absl::StatusOr<std::string> Look() {
    ++num_looks_;
    if (hangs_) release_.WaitForNotification();
    if (throws_) throw std::bad_alloc();
    return absl::StrCat("look ", num_looks_.load());
  }

  static absl::StatusOr<std::string> Ask(StringLook& look) {
    absl::StatusOr<std::string> answer;
    absl::Notification done;
    look.Ask([&](const absl::StatusOr<std::string>& given) {
      answer = given;
      done.Notify();
    });
    done.WaitForNotification();
    return answer;
  }

  std::atomic<int> num_looks_ = 0;
  std::atomic<bool> hangs_ = false;
  std::atomic<bool> throws_ = false;
  absl::Notification release_;
  WorkPool timers_{1, 10};
  WorkPool lookers_{1, 10};
};

TEST_F(SharedLookTest, AnAnswerIsKeptForAWhile) {
  const auto look = Make(kLong, kLong);
  EXPECT_EQ(*Ask(*look), "look 1");
  EXPECT_EQ(*Ask(*look), "look 1");
  const auto forgetful = Make(absl::ZeroDuration(), kLong);
  EXPECT_EQ(*Ask(*forgetful), "look 2");
  EXPECT_EQ(*Ask(*forgetful), "look 3");
  EXPECT_EQ(timers_.num_timers(), 0) << "a timer of a look that has ended";
}

TEST_F(SharedLookTest, OneLookAnswersAllWhoAskMeanwhile) {
  constexpr int kNumAsking = 8;
  hangs_ = true;
  const auto look = Make(absl::ZeroDuration(), kLong);
  absl::BlockingCounter num_waiting(kNumAsking);
  std::vector<std::string> answers(kNumAsking);
  for (std::string& answer : answers) {
    look->Ask([&](const absl::StatusOr<std::string>& given) {
      answer = *given;
      num_waiting.DecrementCount();
    });
  }
  release_.Notify();
  num_waiting.Wait();
  EXPECT_THAT(answers, testing::Each("look 1"));
  EXPECT_EQ(num_looks_, 1);
}

TEST_F(SharedLookTest, WhoeverAsksDuringALookThatHangsIsToldInTime) {
  hangs_ = true;
  const auto look = Make(kLong, absl::Milliseconds(20));
  const absl::Status status = Ask(*look).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(status.message(), "the store has not answered within 20ms");
  EXPECT_EQ(Ask(*look).status(), status);  // at once, and without another look
  release_.Notify();
  lookers_.Stop();
  EXPECT_EQ(num_looks_, 1);
  EXPECT_EQ(*Ask(*look), "look 1");  // it counts when it has come
}

TEST_F(SharedLookTest, ALookThatThrowsIsAnError) {
  throws_ = true;
  const auto look = Make(absl::ZeroDuration(), kLong);
  EXPECT_EQ(Ask(*look).status().code(), absl::StatusCode::kResourceExhausted);
  throws_ = false;
  EXPECT_EQ(*Ask(*look), "look 2");
}

TEST_F(SharedLookTest, AfterTheEndOfThePoolsItIsRefused) {
  lookers_.Stop();
  const auto look = Make(kLong, kLong);
  EXPECT_EQ(Ask(*look).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(num_looks_, 0);
}

}  // namespace
}  // namespace liquidblend::server

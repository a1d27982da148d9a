#include "server/frames/unread_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/base/errors.h"

namespace liquidblend::server::unread_frames_test {
namespace {

class CountingReader final : public UnreadFrames::Reader {
 public:
  void GiveUp() override { ++num_given_up; }
  int num_given_up = 0;
};

FramePtr FrameOf(size_t num_bytes) { return std::make_shared<const std::string>(num_bytes, 'x'); }

class UnreadFramesTest : public testing::Test {
 protected:
  absl::StatusOr<FramePtr> Hold(const std::string& client, const FramePtr& frame,
                                absl::Duration now = absl::ZeroDuration()) {
    return unread_.Hold(client, frame, reader_, now);
  }

  UnreadFrames unread_{{.max_bytes = 100, .patience = absl::Seconds(30)}};
  std::shared_ptr<CountingReader> reader_ = std::make_shared<CountingReader>();
};

TEST_F(UnreadFramesTest, AFrameCountsUntilItsLastCopyIsGone) {
  const FramePtr frame = FrameOf(60);
  absl::StatusOr<FramePtr> held = Hold("a", frame);
  ASSERT_TRUE(held.ok());
  EXPECT_EQ(held->get(), frame.get());
  FramePtr copy = *held;
  held = FramePtr();
  EXPECT_EQ(unread_.num_bytes(), 60);
  copy = nullptr;
  EXPECT_EQ(unread_.num_bytes(), 0);
}

TEST_F(UnreadFramesTest, AFrameOfManyReadersCountsOnce) {
  const FramePtr frame = FrameOf(60);
  std::vector<FramePtr> held;
  for (int k = 0; k < 10; ++k) held.push_back(*Hold("a", frame));
  EXPECT_EQ(unread_.num_bytes(), 60);
  held.pop_back();
  EXPECT_EQ(unread_.num_bytes(), 60);
  held.clear();
  EXPECT_EQ(unread_.num_bytes(), 0);
}

TEST_F(UnreadFramesTest, WhoReadsNothingIsRefusedMoreAndOthersAreNot) {
  std::vector<FramePtr> held;
  for (int k = 0; k < 10; ++k) held.push_back(*Hold("greedy", FrameOf(10)));
  const absl::Status refused = Hold("greedy", FrameOf(10)).status();
  EXPECT_TRUE(absl::IsUnavailable(refused)) << refused;
  EXPECT_EQ(ReasonOf(refused), "TOO_MANY_ANSWERS");
  held.push_back(*Hold("honest", FrameOf(40)));  // half of the budget is its part
  EXPECT_FALSE(Hold("honest", FrameOf(20)).ok());
  held.clear();
  EXPECT_TRUE(Hold("greedy", FrameOf(10)).ok());
}

TEST_F(UnreadFramesTest, AllTogetherTakeAtMostTwiceTheBudget) {
  std::vector<FramePtr> held;
  for (int k = 0; k < 1000; ++k) {
    const absl::StatusOr<FramePtr> frame = Hold("client" + std::to_string(k), FrameOf(20));
    if (frame.ok()) held.push_back(*frame);
  }
  EXPECT_GE(unread_.num_bytes(), 100);
  EXPECT_LE(unread_.num_bytes(), 200);
}

TEST_F(UnreadFramesTest, ConnectionsOfAHostHaveOneAccount) {
  std::vector<FramePtr> held;
  for (int k = 0; k < 10; ++k) {
    held.push_back(*Hold("ipv4:10.0.0.1:" + std::to_string(k), FrameOf(10)));
  }
  EXPECT_FALSE(Hold("ipv4:10.0.0.1:999", FrameOf(10)).ok());
  EXPECT_TRUE(Hold("ipv4:10.0.0.2:1", FrameOf(10)).ok());
}

TEST_F(UnreadFramesTest, OneFrameMayBeLargerThanTheBudget) {
  const absl::StatusOr<FramePtr> large = Hold("a", FrameOf(1000));
  EXPECT_TRUE(large.ok());
  EXPECT_FALSE(Hold("a", FrameOf(1)).ok());
}

TEST_F(UnreadFramesTest, ReadersThatStallAreEndedWhileMemoryIsShort) {
  const auto late = std::make_shared<CountingReader>();
  const FramePtr first = *Hold("a", FrameOf(30));
  const FramePtr second = *unread_.Hold("a", FrameOf(30), late, absl::Seconds(20));
  EXPECT_TRUE(Hold("b", FrameOf(1), absl::Seconds(29)).ok());
  EXPECT_EQ(reader_->num_given_up, 0);
  EXPECT_TRUE(Hold("b", FrameOf(1), absl::Seconds(31)).ok());
  EXPECT_EQ(reader_->num_given_up, 1);
  EXPECT_EQ(late->num_given_up, 0);
}

TEST_F(UnreadFramesTest, WhileThereIsMemoryAReaderMayTakeItsTime) {
  const FramePtr held = *Hold("a", FrameOf(50));
  EXPECT_TRUE(Hold("b", FrameOf(50), absl::Hours(1)).ok());
  EXPECT_EQ(reader_->num_given_up, 0);
}

TEST(UnreadFrames, AFrameMayOutliveThem) {
  FramePtr held;
  {
    UnreadFrames unread;
    held = *unread.Hold("a", FrameOf(10), {}, absl::ZeroDuration());
  }
  EXPECT_EQ(held->size(), 10);
}

}  // namespace
}  // namespace liquidblend::server::unread_frames_test

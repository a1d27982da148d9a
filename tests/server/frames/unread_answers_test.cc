#include "server/frames/unread_answers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/base/errors.h"

namespace liquidblend::server::unread_answers_test {
namespace {

class CountingReader final : public UnreadAnswers::Reader {
 public:
  explicit CountingReader(std::string account) : account_(std::move(account)) {}
  std::string account() const override { return account_; }
  void GiveUp() override { ++num_given_up; }

  int num_given_up = 0;

 private:
  const std::string account_;
};

AnswerPtr AnswerOf(size_t num_bytes) { return std::make_shared<const std::string>(num_bytes, 'x'); }

class UnreadAnswersTest : public testing::Test {
 protected:
  absl::StatusOr<AnswerPtr> Hold(const std::string& account, const AnswerPtr& answer,
                                 absl::Duration now = absl::ZeroDuration()) {
    std::shared_ptr<CountingReader>& reader = readers_[account];
    if (reader == nullptr) reader = std::make_shared<CountingReader>(account);
    return unread_.Hold(answer, reader, now);
  }

  UnreadAnswers unread_{{.max_bytes = 100, .patience = absl::Seconds(30)}};
  std::map<std::string, std::shared_ptr<CountingReader>> readers_;
};

TEST_F(UnreadAnswersTest, AnAnswerCountsUntilItsLastCopyIsGone) {
  const AnswerPtr answer = AnswerOf(60);
  absl::StatusOr<AnswerPtr> held = Hold("a", answer);
  ASSERT_TRUE(held.ok());
  EXPECT_EQ(held->get(), answer.get());
  AnswerPtr copy = *held;
  held = AnswerPtr();
  EXPECT_EQ(unread_.num_bytes(), 60);
  copy = nullptr;
  EXPECT_EQ(unread_.num_bytes(), 0);
}

TEST_F(UnreadAnswersTest, AnAnswerOfManyReadersCountsOnce) {
  const AnswerPtr answer = AnswerOf(60);
  std::vector<AnswerPtr> held;
  for (int k = 0; k < 10; ++k) held.push_back(*Hold("a", answer));
  EXPECT_EQ(unread_.num_bytes(), 60);
  held.pop_back();
  EXPECT_EQ(unread_.num_bytes(), 60);
  held.clear();
  EXPECT_EQ(unread_.num_bytes(), 0);
}

TEST_F(UnreadAnswersTest, WhoReadsNothingIsRefusedMoreAndOthersAreNot) {
  std::vector<AnswerPtr> held;
  for (int k = 0; k < 10; ++k) held.push_back(*Hold("greedy", AnswerOf(10)));
  const absl::Status refused = Hold("greedy", AnswerOf(10)).status();
  EXPECT_TRUE(absl::IsUnavailable(refused)) << refused;
  EXPECT_EQ(ReasonOf(refused), "TOO_MANY_ANSWERS");
  held.push_back(*Hold("honest", AnswerOf(40)));  // half of the budget is its part
  EXPECT_FALSE(Hold("honest", AnswerOf(20)).ok());
  held.clear();
  EXPECT_TRUE(Hold("greedy", AnswerOf(10)).ok());
}

// Each takes all that it gets; the parts alone would be 100 + 50 + 33 + 25.
TEST_F(UnreadAnswersTest, AllTogetherTakeAtMostTwiceTheBudget) {
  std::vector<AnswerPtr> held;
  for (int account = 0; account < 50; ++account) {
    for (int k = 0; k < 101; ++k) {
      const absl::StatusOr<AnswerPtr> answer =
          Hold("client" + std::to_string(account), AnswerOf(1));
      if (answer.ok()) held.push_back(*answer);
    }
    ASSERT_EQ(account == 0, unread_.num_bytes() == 100) << account;
  }
  EXPECT_EQ(unread_.num_bytes(), 200);
}

TEST_F(UnreadAnswersTest, OneAnswerMayBeLargerThanTheBudget) {
  const absl::StatusOr<AnswerPtr> large = Hold("a", AnswerOf(1000));
  EXPECT_TRUE(large.ok());
  EXPECT_FALSE(Hold("a", AnswerOf(1)).ok());
}

TEST_F(UnreadAnswersTest, ReadersThatStallAreEndedWhileMemoryIsShort) {
  const AnswerPtr first = *Hold("early", AnswerOf(30));
  const AnswerPtr second = *Hold("late", AnswerOf(30), absl::Seconds(20));
  EXPECT_TRUE(Hold("b", AnswerOf(1), absl::Seconds(29)).ok());
  EXPECT_EQ(readers_["early"]->num_given_up, 0);
  EXPECT_TRUE(Hold("b", AnswerOf(1), absl::Seconds(31)).ok());
  EXPECT_EQ(readers_["early"]->num_given_up, 1);
  EXPECT_EQ(readers_["late"]->num_given_up, 0);
}

TEST_F(UnreadAnswersTest, WhileThereIsMemoryAReaderMayTakeItsTime) {
  const AnswerPtr held = *Hold("a", AnswerOf(50));
  EXPECT_TRUE(Hold("b", AnswerOf(50), absl::Hours(1)).ok());
  EXPECT_EQ(readers_["a"]->num_given_up, 0);
}

TEST(UnreadAnswers, AnAnswerMayOutliveThem) {
  const auto reader = std::make_shared<CountingReader>("a");
  AnswerPtr held;
  {
    UnreadAnswers unread;
    held = *unread.Hold(AnswerOf(10), reader, absl::ZeroDuration());
  }
  EXPECT_EQ(held->size(), 10);
}

}  // namespace
}  // namespace liquidblend::server::unread_answers_test

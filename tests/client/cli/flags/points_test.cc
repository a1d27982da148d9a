#include "client/cli/flags/points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace liquidblend::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

RegisterRequest Walls() {
  RegisterRequest request;
  request.source = "w0";
  request.targets = {"animations/w1", "w2"};
  return request;
}

std::string Refusal(const std::vector<std::string>& texts) {
  const absl::Status status = ParsePoints(texts, Walls()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

TEST(ParsePoints, OrdersPointsAsTheAnimationsAndValuesAsTheFirstPoint) {
  const auto space = ParsePoints(
      {"w1:width=1,height=-20", "animations/w0:height=3,width=0.5", "w2:width=2,height=6"},
      Walls());
  ASSERT_TRUE(space.ok()) << space.status();
  EXPECT_THAT(space->names, ElementsAre("width", "height"));
  EXPECT_THAT(space->points,
              ElementsAre(ElementsAre(0.5, 3), ElementsAre(1, -20), ElementsAre(2, 6)));
}

TEST(ParsePoints, GivesNoPointsForNone) {
  const auto space = ParsePoints({}, Walls());
  ASSERT_TRUE(space.ok()) << space.status();
  EXPECT_TRUE(space->names.empty());
  EXPECT_TRUE(space->points.empty());
}

TEST(ParsePoints, NamesWhatIsWrong) {
  EXPECT_THAT(Refusal({"w0:a=1", "w1:a=2"}), HasSubstr("--at is missing for 'w2'"));
  EXPECT_THAT(Refusal({"w0:a=1", "w1:a=2", "w2:a=3", "w3:a=4"}), HasSubstr("--at w3: is neither"));
  EXPECT_THAT(Refusal({"w0:a=1", "animations/w0:a=2"}), HasSubstr("w0 is given twice"));
  EXPECT_THAT(Refusal({"w0:a=1", "w1:b=2", "w2:a=3"}), HasSubstr("w1: must set exactly a"));
  EXPECT_THAT(Refusal({"w0:a=1", "w1:a=2,b=2", "w2:a=3"}), HasSubstr("w1: must set exactly a"));
  EXPECT_THAT(Refusal({"w0"}), HasSubstr("\"\" is not NAME=NUMBER"));
  EXPECT_THAT(Refusal({"w0:a=wide"}), HasSubstr("\"a=wide\" is not NAME=NUMBER"));
  EXPECT_THAT(Refusal({"w0:a=1,a=2"}), HasSubstr("a is twice"));
}

}  // namespace
}  // namespace liquidblend::cli

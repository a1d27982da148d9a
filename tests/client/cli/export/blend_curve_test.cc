#include "client/cli/export/blend_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/temp_files.h"

namespace liquidblend::cli {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

BlendCurve Weights(const std::string& text) {
  BlendFlags flags;
  flags.weights = text;
  const absl::StatusOr<BlendCurve> curve = ToBlendCurve(flags);
  EXPECT_TRUE(curve.ok()) << curve.status();
  return curve.ok() ? *curve : BlendCurve({BlendCurve::Key()});
}

std::string ErrorOf(const std::string& weights, const std::string& parameters = "") {
  BlendFlags flags;
  flags.weights = weights;
  flags.parameters = parameters;
  const absl::StatusOr<BlendCurve> curve = ToBlendCurve(flags);
  EXPECT_FALSE(curve.ok());
  return std::string(curve.status().message());
}

TEST(BlendCurve, WithoutTimesIsTheSameAtAllTimes) {
  const BlendCurve curve = Weights("0.25,-0.5");
  EXPECT_TRUE(curve.is_constant());
  EXPECT_THAT(curve.At(7).weights, ElementsAre(0.25, -0.5));
}

TEST(BlendCurve, IsLinearBetweenKeysAndConstantBeyond) {
  const BlendCurve curve = Weights("1:0,0/2:1,0/4:1,-1");
  EXPECT_FALSE(curve.is_constant());
  EXPECT_THAT(curve.At(0).weights, ElementsAre(0, 0));
  EXPECT_THAT(curve.At(1).weights, ElementsAre(0, 0));
  EXPECT_THAT(curve.At(1.25).weights, ElementsAre(DoubleNear(0.25, 1e-12), 0));
  EXPECT_THAT(curve.At(2).weights, ElementsAre(1, 0));
  EXPECT_THAT(curve.At(3).weights, ElementsAre(1, DoubleNear(-0.5, 1e-12)));
  EXPECT_THAT(curve.At(9).weights, ElementsAre(1, -1));
}

TEST(BlendCurve, OfParametersMovesThroughTheirSpace) {
  BlendFlags flags;
  flags.parameters = "0:height=1,width=2/2:width=4,height=1";
  flags.extrapolate = true;
  const absl::StatusOr<BlendCurve> curve = ToBlendCurve(flags);
  ASSERT_TRUE(curve.ok()) << curve.status();
  EXPECT_EQ(curve->At(1).parameters, (Parameters{{"height", 1}, {"width", 3}}));
  EXPECT_TRUE(curve->At(1).extrapolate);
}

TEST(BlendCurve, IsReadFromAFile) {
  const testing::TempDir dir;
  dir.Write("curve.txt", "# a sweep\n0: 0\n\n1: 0.5  # half-way\n2: 1/3:0\n");
  const BlendCurve curve = Weights("@" + dir.File("curve.txt"));
  EXPECT_EQ(curve.num_keys(), 4U);
  EXPECT_THAT(curve.At(1).weights, ElementsAre(0.5));
  EXPECT_THAT(ErrorOf("@" + dir.File("none.txt")), HasSubstr("none.txt: cannot be read"));
  dir.Write("empty.txt", "# nothing\n");
  EXPECT_THAT(ErrorOf("@" + dir.File("empty.txt")), HasSubstr("holds no key TIME:VALUE"));
}

TEST(BlendCurve, NamesTheKeyThatIsWrong) {
  EXPECT_EQ(ErrorOf("0:0/x:1"), "--weights: key 2, \"x:1\": is not TIME:VALUE, such as 1.5:0.25");
  EXPECT_THAT(ErrorOf("0:0/1:"), HasSubstr("key 2, \"1:\": is not TIME:VALUE"));
  EXPECT_THAT(ErrorOf("0:0/9:3"), HasSubstr("key 2, \"9:3\": has weight 3, not in [-1, 2]"));
  EXPECT_THAT(ErrorOf("0:0/1:0.5,y"), HasSubstr("key 2: --weights 0.5,y: \"y\" is not a number"));
  EXPECT_THAT(ErrorOf("1:0/1:1"),
              HasSubstr("key 2, \"1:1\": its time 1 is not after that of the key before, 1"));
  EXPECT_THAT(ErrorOf("0:0/1:1,0"), HasSubstr("key 2, \"1:1,0\": has 2 weights, the key before 1"));
  EXPECT_THAT(
      ErrorOf("", "0:a=1/1:b=1"),
      HasSubstr("--parameters: key 2, \"1:b=1\": has not the parameters of the key before"));
  EXPECT_THAT(ErrorOf("", ""), HasSubstr("is required"));
}

}  // namespace
}  // namespace liquidblend::cli

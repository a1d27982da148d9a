#include "core/mesh/time_axis.h"

#include <gtest/gtest.h>

#include <cmath>

namespace liquidblend::mesh {
namespace {

constexpr double kFps = 24.0;

TEST(TimeAxis, WithoutARestTimeTicksAreFrames) {
  const TimeAxis axis(std::nullopt, kFps, 72);
  EXPECT_TRUE(axis.counts_frames());
  for (const double frames : {-3.0, 0.0, 0.05, 17.3, 71.0, 99.0}) {
    EXPECT_EQ(axis.Ticks(frames), frames);
    EXPECT_EQ(axis.Frames(frames), frames);
  }
}

// So the end of a pre-roll hardly shifts the mean of times.
TEST(TimeAxis, APreRollIsAThousandthOfATick) {
  for (const std::optional<double> rest_s : {std::optional<double>(), std::optional(-0.1)}) {
    const TimeAxis axis(rest_s, kFps, 72, 8);
    EXPECT_FALSE(axis.counts_frames());
    EXPECT_DOUBLE_EQ(axis.Ticks(-8), -1e-3);
    EXPECT_DOUBLE_EQ(axis.Ticks(-0.5), -1e-3 / 16);
    EXPECT_EQ(axis.Ticks(0), 0);
    // Before it ticks are as long as frames, so that extrapolated times stay what they are.
    EXPECT_DOUBLE_EQ(axis.Ticks(-9.5), -1.5 - 1e-3);
    for (double frame = -12; frame < 80; frame += 0.37) {
      EXPECT_NEAR(axis.Frames(axis.Ticks(frame)), frame, 1e-9);
      EXPECT_LT(axis.Ticks(frame), axis.Ticks(frame + 0.125)) << frame;
    }
    EXPECT_EQ(axis.Ticks(17.3), TimeAxis(rest_s, kFps, 72).Ticks(17.3));
    Eigen::Matrix4Xf vertices(4, 3), displacement(4, 3);
    vertices << Eigen::Matrix<float, 3, 3>::Zero(), -8, -0.5, 3;
    displacement << Eigen::Matrix<float, 3, 3>::Ones(), 10, 0.25, 2;
    Eigen::Matrix4Xf ticks = vertices, moved = displacement;
    axis.ToTicks(vertices, moved);
    axis.ToTicks(ticks);
    EXPECT_NEAR(ticks(3, 0) + moved(3, 0), axis.Ticks(2), 1e-6);
    EXPECT_LT(ticks(3, 1) + moved(3, 1), 0);
    axis.ToFrames(ticks);
    axis.ToFrames(ticks, moved);
    EXPECT_LT((ticks - vertices).norm(), 1e-5);
    EXPECT_LT((moved - displacement).norm(), 2e-2);
  }
}

class SquaresTest : public ::testing::TestWithParam<double> {};

TEST_P(SquaresTest, BothEndsStayAndTheOrderToo) {
  const TimeAxis axis(GetParam(), kFps, 72);
  EXPECT_FALSE(axis.counts_frames());
  EXPECT_EQ(axis.Ticks(0), 0);
  EXPECT_EQ(axis.Ticks(71), 71);
  EXPECT_EQ(axis.Frames(71), 71);
  EXPECT_EQ(axis.Ticks(-0.5), -0.5);
  for (double frame = -1; frame < 80; frame += 0.125) {
    EXPECT_LT(axis.Ticks(frame), axis.Ticks(frame + 0.125)) << frame;
  }
}

TEST_P(SquaresTest, FramesAreTheInverseOfTicks) {
  const TimeAxis axis(GetParam(), kFps, 72);
  for (double frame = -2; frame < 90; frame += 0.37) {
    EXPECT_NEAR(axis.Frames(axis.Ticks(frame)), frame, 1e-9);
  }
}

// All at rest at the axis' rest time.
TEST_P(SquaresTest, AMeanOfFallsTakesAsLongAsTheFallFromTheMeanHeight) {
  const TimeAxis axis(GetParam(), kFps, 72);
  const auto landing = [](double height_m) {
    return kFps * (GetParam() + std::sqrt(2 * height_m / 9.81));
  };
  const double low_m = 4, high_m = 9;
  for (const double weight : {0.25, 0.5, 0.8, 1.2}) {
    const double ticks =
        (1 - weight) * axis.Ticks(landing(low_m)) + weight * axis.Ticks(landing(high_m));
    const double mean = landing((1 - weight) * low_m + weight * high_m);
    EXPECT_NEAR(axis.Frames(ticks), mean, 1e-9);
    EXPECT_GT(std::abs((1 - weight) * landing(low_m) + weight * landing(high_m) - mean), 0.1);
  }
}

INSTANTIATE_TEST_SUITE_P(RestTimes, SquaresTest, testing::Values(0.0, -0.05, -0.4));

TEST(TimeAxis, TheLastFrameStaysWhateverTheRestTime) {
  for (int n = 2; n < 300; ++n) {
    const TimeAxis axis(-0.01 * (n % 97), 24.0 + n, n);
    EXPECT_EQ(axis.Ticks(n - 1), n - 1);
    EXPECT_EQ(axis.Frames(n - 1), n - 1);
  }
}

TEST(TimeAxis, RestLongAgoIsAlmostLinear) {
  const TimeAxis axis(-3600.0, kFps, 72);
  for (double frame = 0; frame <= 71; ++frame) EXPECT_NEAR(axis.Ticks(frame), frame, 0.02);
}

TEST(TimeAxis, OfASingleFrameHasNothingToSquare) {
  const TimeAxis axis(0.0, kFps, 1);
  EXPECT_EQ(axis.Ticks(0.5), 0.5);
  EXPECT_EQ(axis.Frames(0.5), 0.5);
}

TEST(TimeAxis, DisplacementsLeadToTheTicksOfWhereTheyLed) {
  const TimeAxis axis(0.0, kFps, 10);
  Eigen::Matrix4Xf vertices(4, 3);
  vertices << 1, 2, 3, 4, 5, 6, 7, 8, 9, -0.5F, 2, 8.5F;
  Eigen::Matrix4Xf displacement(4, 3);
  displacement << 1, 1, 1, 1, 1, 1, 1, 1, 1, 0.75F, -1.5F, 3;
  Eigen::Matrix4Xf ticks = vertices, moved = displacement;
  axis.ToTicks(vertices, moved);
  axis.ToTicks(ticks);
  EXPECT_EQ(ticks.topRows<3>(), vertices.topRows<3>());
  EXPECT_EQ(moved.topRows<3>(), displacement.topRows<3>());
  for (int v = 0; v < 3; ++v) {
    EXPECT_NEAR(ticks(3, v) + moved(3, v), axis.Ticks(vertices(3, v) + displacement(3, v)), 1e-5);
  }
  axis.ToFrames(ticks);
  EXPECT_TRUE(ticks.isApprox(vertices, 1e-5F)) << ticks;
  axis.ToFrames(vertices, moved);
  EXPECT_TRUE(moved.isApprox(displacement, 1e-5F)) << moved;
}

TEST(TimeAxis, NoDisplacementStaysNone) {
  const TimeAxis axis(0.0, kFps, 10);
  Eigen::Matrix4Xf none(4, 0);
  axis.ToTicks(Eigen::Matrix4Xf::Zero(4, 7), none);
  axis.ToFrames(Eigen::Matrix4Xf::Zero(4, 7), none);
  EXPECT_EQ(none.cols(), 0);
}

}  // namespace
}  // namespace liquidblend::mesh

#include "core/parameters/interpolator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/core/parameters/spaces_testing.h"

namespace liquidblend::parameters {
namespace {

using testing::DoubleNear;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pointwise;

constexpr mesh::Range kLimits = {-1.0, 2.0};

mesh::ParameterSpace Smooth(mesh::ParameterSpace space) {
  space.interpolation = mesh::Interpolation::kSmooth;
  return space;
}

Interpolator MakeInterpolator(const mesh::ParameterSpace& space) {
  absl::StatusOr<Interpolator> made = Interpolator::Make(space);
  EXPECT_TRUE(made.ok()) << made.status();
  return *std::move(made);
}

Location LocateIn(const Interpolator& space, const Values& point,
                  Outside outside = Outside::kRefuse) {
  const absl::StatusOr<Location> location = space.Locate(point, outside, kLimits);
  EXPECT_TRUE(location.ok()) << location.status();
  return location.value_or(Location());
}

TEST(Interpolator, OfALinearSpaceIsTheTriangulation) {
  const mesh::ParameterSpace space = RandomSpace(2, 9, 3);
  const Interpolator linear = MakeInterpolator(space);
  const Triangulation triangulation = *Triangulation::Make(space);
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) {
    Values point = RandomMixture(space, random);
    for (double& x : point) x = 1.0 + 2.0 * (x - 1.0);
    EXPECT_EQ(LocateIn(linear, point, Outside::kExtrapolate).weights,
              triangulation.Locate(point, Outside::kExtrapolate)->weights);
  }
}

TEST(Interpolator, OfThreeSmoothPointsIsTheQuadraticInUnitsOfTheUser) {
  const Interpolator throws = MakeInterpolator(Smooth(SpaceOf({{10}, {30}, {50}})));
  EXPECT_THAT(LocateIn(throws, {20}).weights, ElementsAre(0.75, -0.125));
  EXPECT_THAT(LocateIn(throws, {40}).weights, ElementsAre(0.75, 0.375));
  const Location beyond = LocateIn(throws, {55}, Outside::kExtrapolate);
  EXPECT_TRUE(beyond.is_extrapolated);
  EXPECT_THAT(beyond.weights, ElementsAre(-0.5625, 1.40625));
}

// The triangulation has the corners on one diagonal alone there, whichever came first.
TEST(Interpolator, OfASmoothRectangleHasAQuarterOfEachCornerInItsMiddle) {
  const Interpolator corners = MakeInterpolator(Smooth(GridOf({{0.5, 1.0}, {20, 60}})));
  EXPECT_THAT(LocateIn(corners, {0.75, 40}).weights, ElementsAre(0.25, 0.25, 0.25));
}

TEST(Interpolator, OfASmoothSpaceIsExactAtAnimationsHoweverCloseTheyAre) {
  for (const mesh::ParameterSpace& space :
       {RandomSpace(1, 9, 3), RandomSpace(2, 17, 3), RandomSpace(3, 17, 3), RandomSpace(4, 17, 3),
        SpaceOf({{0}, {3}, {1e-3}, {1}, {1 + 1e-4}})}) {
    const Interpolator smooth = MakeInterpolator(Smooth(space));
    for (size_t k = 0; k < space.points.size(); ++k) {
      Values expected(space.points.size() - 1, 0.0);
      if (k > 0) expected[k - 1] = 1.0;
      EXPECT_EQ(LocateIn(smooth, space.points[k]).weights, expected);
    }
  }
}

TEST(Interpolator, OfASmoothSpaceGivesPointsBackWithinTheLimits) {
  for (const int d : {1, 2, 3, 4}) {
    const mesh::ParameterSpace space = Smooth(RandomSpace(d, 17, 11));
    const Interpolator smooth = MakeInterpolator(space);
    std::mt19937 random(7);
    for (int i = 0; i < 300; ++i) {
      const Values point = RandomMixture(space, random);
      const Location location = LocateIn(smooth, point);
      EXPECT_FALSE(location.is_extrapolated);
      EXPECT_THAT(BlendOf(space, location.weights), Pointwise(DoubleNear(1e-7), point));
      EXPECT_THAT(location.weights, Each(testing::AllOf(testing::Ge(-1.0), testing::Le(2.0))));
      for (const double weight : location.weights) EXPECT_EQ(weight, RoundedWeight(weight));
    }
  }
}

// Between 0.05 and 1, the quadratic would have weights of up to 5.3.
TEST(Interpolator, OfASmoothSpaceReachesItsLimitsWithoutAJump) {
  const Interpolator line = MakeInterpolator(Smooth(SpaceOf({{0}, {0.05}, {1}})));
  constexpr double kStep = 1e-3;
  double largest = 0.0;
  Values last = LocateIn(line, {-0.04}, Outside::kExtrapolate).weights;
  for (double x = -0.04 + kStep; x < 1.1; x += kStep) {
    const Values weights = LocateIn(line, {x}, Outside::kExtrapolate).weights;
    EXPECT_THAT(weights, Pointwise(DoubleNear(40.0 * kStep), last)) << x;
    largest = std::max(largest, weights[0]);
    last = weights;
  }
  EXPECT_EQ(largest, 2.0);
}

TEST(Interpolator, OfASmoothSpaceIsContinuousAcrossTheHull) {
  const Interpolator smooth = MakeInterpolator(Smooth(GridOf({{0, 1}, {0, 0.1, 1}, {0, 1}})));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(0.01, 0.99);
  for (int i = 0; i < 300; ++i) {
    Values inside = {anywhere(random), anywhere(random), anywhere(random)};
    inside[i % 3] = i % 2;
    Values outside = inside;
    outside[i % 3] += i % 2 == 0 ? -1e-5 : 1e-5;
    const Location beyond = LocateIn(smooth, outside, Outside::kExtrapolate);
    EXPECT_TRUE(beyond.is_extrapolated);
    EXPECT_THAT(beyond.weights, Pointwise(DoubleNear(1e-3), LocateIn(smooth, inside).weights));
  }
}

TEST(Interpolator, OfASmoothSpaceRefusesPointsOutsideAndNothingThatLinearOnesAnswer) {
  const mesh::ParameterSpace space = RandomSpace(2, 9, 3);
  const Interpolator linear = MakeInterpolator(space);
  const Interpolator smooth = MakeInterpolator(Smooth(space));
  EXPECT_TRUE(absl::IsOutOfRange(smooth.Locate(Values{6, 6}, Outside::kRefuse, kLimits).status()));
  const auto is_within = [](const Values& weights) {
    return std::all_of(weights.begin(), weights.end(), [](double w) { return kLimits.Holds(w); });
  };
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-12.0, 14.0);
  for (int i = 0; i < 300; ++i) {
    const Values point = {anywhere(random), anywhere(random)};
    if (!is_within(LocateIn(linear, point, Outside::kExtrapolate).weights)) continue;
    EXPECT_TRUE(is_within(LocateIn(smooth, point, Outside::kExtrapolate).weights));
  }
}

TEST(Interpolator, RefusesWhatCannotBeSmoothOrTriangulated) {
  EXPECT_THAT(std::string(Interpolator::Make(Smooth(SpaceOf({{0}, {1}}))).status().message()),
              HasSubstr("smooth interpolation of 1 parameter needs at least 3 animations, got 2"));
  EXPECT_THAT(std::string(Interpolator::Make(Smooth(SpaceOf({{1}, {1}, {1}}))).status().message()),
              HasSubstr("p0 is 1 for all animations"));
}

}  // namespace
}  // namespace liquidblend::parameters

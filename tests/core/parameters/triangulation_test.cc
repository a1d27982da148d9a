#include "core/parameters/triangulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

#include "core/parameters/delaunay.h"
#include "tests/core/parameters/spaces_testing.h"

namespace liquidblend::parameters {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pointwise;

Triangulation Make(const mesh::ParameterSpace& space) {
  absl::StatusOr<Triangulation> made = Triangulation::Make(space);
  EXPECT_TRUE(made.ok()) << made.status();
  return *std::move(made);
}

std::string Refusal(const mesh::ParameterSpace& space) {
  const absl::Status status = Triangulation::Make(space).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

Location Locate(const Triangulation& triangulation, const Values& point,
                Outside outside = Outside::kRefuse) {
  const absl::StatusOr<Location> location = triangulation.Locate(point, outside);
  EXPECT_TRUE(location.ok()) << location.status();
  return location.value_or(Location());
}

// The smallest of all weights, the source's included.
double SmallestWeight(const Values& weights) {
  double source = 1.0;
  double smallest = 1.0;
  for (const double weight : weights) {
    source -= weight;
    smallest = std::min(smallest, weight);
  }
  return std::min(source, smallest);
}

// At points inside of the hull, the weights are positive and give the point back.
void ExpectReproducesPoints(const mesh::ParameterSpace& space) {
  const Triangulation triangulation = Make(space);
  std::mt19937 random(7);
  for (int i = 0; i < 300; ++i) {
    const Values point = RandomMixture(space, random);
    const Location location = Locate(triangulation, point);
    EXPECT_FALSE(location.is_extrapolated);
    EXPECT_GE(SmallestWeight(location.weights), -kExact);
    EXPECT_THAT(BlendOf(space, location.weights), Pointwise(DoubleNear(1e-7), point));
  }
}

void ExpectExactAtAnimations(const mesh::ParameterSpace& space) {
  const Triangulation triangulation = Make(space);
  for (size_t k = 0; k < space.points.size(); ++k) {
    Values expected(space.points.size() - 1, 0.0);
    if (k > 0) expected[k - 1] = 1.0;
    EXPECT_EQ(Locate(triangulation, space.points[k]).weights, expected);
  }
}

TEST(Triangulation, IsExactAtAnimations) {
  ExpectExactAtAnimations(SpaceOf({{0.3}, {7.0}, {-2.0}, {0.4}}));
  for (const int d : {1, 2, 3, 4}) ExpectExactAtAnimations(RandomSpace(d, 17, 3));
  ExpectExactAtAnimations(GridOf({{0.5, 0.9}, {0.1, 0.3}, {-4, 9}, {1e6, 3e6}}));
}

TEST(Triangulation, ReproducesPointsAndNeedsNoNegativeWeights) {
  for (const int d : {1, 2, 3, 4}) {
    ExpectReproducesPoints(RandomSpace(d, d + 1, 5));
    ExpectReproducesPoints(RandomSpace(d, 17, 11));
  }
}

TEST(Triangulation, ReproducesPointsOfGrids) {
  ExpectReproducesPoints(GridOf({{0.1, 0.2, 0.3}, {0.1, 0.7, 0.9}}));
  ExpectReproducesPoints(GridOf({{0, 1, 2}, {10, 20}, {0.3, 0.4, 0.9}}));
  ExpectReproducesPoints(GridOf({{0, 1}, {10, 20}, {0.3, 0.4}, {1e-5, 3e-5, 4e-5}}));
}

TEST(Triangulation, InterpolatesBetweenNeighboursInOneDimension) {
  const Triangulation line = Make(SpaceOf({{10}, {40}, {20}}));
  EXPECT_EQ(line.num_simplices(), 2);
  EXPECT_THAT(Locate(line, {12.5}).weights, ElementsAre(0.0, 0.25));
  EXPECT_THAT(Locate(line, {35}).weights, ElementsAre(0.75, 0.25));
}

// dam_break's design: source, then the corners beside it, then the one opposite.
TEST(Triangulation, SplitsRectanglesByTheDiagonalFromTheirFirstCorner) {
  const Triangulation corners = Make(GridOf({{0.5, 1.0}, {20, 60}}));
  EXPECT_EQ(corners.num_simplices(), 2);
  EXPECT_THAT(Locate(corners, {0.75, 40}).weights, ElementsAre(0.0, 0.0, 0.5));
  EXPECT_THAT(Locate(corners, {0.875, 30}).weights, ElementsAre(0.5, 0.0, 0.25));
  EXPECT_THAT(Locate(corners, {0.625, 50}).weights, ElementsAre(0.0, 0.5, 0.25));
}

TEST(Triangulation, TheDiagonalFollowsTheOrderOfAnimations) {
  const Triangulation corners = Make(SpaceOf({{1, 0}, {0, 0}, {1, 1}, {0, 1}}));
  EXPECT_THAT(Locate(corners, {0.5, 0.5}).weights, ElementsAre(0.0, 0.0, 0.5));
}

// All simplices of a box have its first corner: 6 in three dimensions, 24 in four.
TEST(Triangulation, SplitsBoxesFromTheirFirstCorner) {
  EXPECT_EQ(Make(GridOf({{0, 2}, {0, 3}, {0, 5}})).num_simplices(), 6);
  EXPECT_EQ(Make(GridOf({{0, 2}, {0, 3}, {0, 5}, {0, 7}})).num_simplices(), 24);
  const Location centre = Locate(Make(GridOf({{0, 2}, {0, 3}, {0, 5}})), {1, 1.5, 2.5});
  EXPECT_THAT(centre.weights, ElementsAre(0, 0, 0, 0, 0, 0, 0.5));
}

// Boxes are split one by one; only if they agree on their common faces do weights not jump there.
TEST(Triangulation, IsContinuousAcrossSplitCells) {
  const mesh::ParameterSpace space = GridOf({{0.0, 0.3, 1.0}, {0.0, 0.45, 1.0}, {0.0, 0.6, 1.0}});
  const Triangulation triangulation = Make(space);
  EXPECT_EQ(triangulation.num_simplices(), 8 * 6);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(0.0, 1.0);
  const Values faces = {0.3, 0.45, 0.6};
  for (int i = 0; i < 300; ++i) {
    Values below = {anywhere(random), anywhere(random), anywhere(random)};
    below[i % 3] = faces[i % 3] - 1e-6;
    Values above = below;
    above[i % 3] = faces[i % 3] + 1e-6;
    EXPECT_THAT(Locate(triangulation, above).weights,
                Pointwise(DoubleNear(1e-4), Locate(triangulation, below).weights));
  }
}

// The simplices of hulls of any shape fill them: their volumes add up to the unit cube's.
TEST(Triangulate, FillsTheHull) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> anywhere(0.0, 1.0);
  for (const int d : {2, 3, 4}) {
    Eigen::MatrixXd points(d, (1 << d) + 10);
    for (int corner = 0; corner < 1 << d; ++corner) {
      for (int i = 0; i < d; ++i) points(i, corner) = corner >> i & 1;
    }
    for (int k = 1 << d; k < points.cols(); ++k) {
      for (int i = 0; i < d; ++i) points(i, k) = anywhere(random);
    }
    const absl::StatusOr<Simplices> simplices = Triangulate(points, kTolerance);
    ASSERT_TRUE(simplices.ok()) << simplices.status();
    double volume = 0.0;
    for (const std::vector<int>& simplex : *simplices) {
      volume += 1.0 / std::abs(BarycentricGradients(points, simplex).determinant());
    }
    EXPECT_NEAR(volume, std::tgamma(d + 1), 1e-9);
  }
}

TEST(Triangulation, HasPointsOnTheSidesOfItsHull) {
  const mesh::ParameterSpace space =
      SpaceOf({{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0.3, 0}, {0.7, 0}, {1, 0.1 + 0.2}});
  ExpectExactAtAnimations(space);
  ExpectReproducesPoints(space);
  EXPECT_THAT(Locate(Make(space), {0.5, 0}).weights, ElementsAre(0, 0, 0, 0.5, 0.5, 0));
}

TEST(Triangulation, TakesPointsOnTheHullAsInside) {
  const Triangulation corners = Make(GridOf({{0.1, 0.7}, {-20, 60}}));
  EXPECT_THAT(Locate(corners, {0.1, 40}).weights, ElementsAre(0.0, 0.75, 0.0));
  const Location just_outside = Locate(corners, {0.1 - 0.5e-6 * 0.6, 40});
  EXPECT_FALSE(just_outside.is_extrapolated);
  EXPECT_THAT(just_outside.weights, Pointwise(DoubleNear(1e-6), Values{0.0, 0.75, 0.0}));
}

TEST(Triangulation, RefusesPointsOutsideAndTellsHowFarTheyAre) {
  const Triangulation corners = Make(GridOf({{0.5, 1.0}, {20, 60}}));
  const absl::Status status = corners.Locate(Values{1.25, 50}, Outside::kRefuse).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("(p0 1.25, p1 50) lies outside of the hull of the family's points, by 0.5 "
                        "of the parameters' ranges; the nearest point of it is (p0 1, p1 50)"));
  EXPECT_TRUE(
      absl::IsOutOfRange(corners.Locate(Values{0.5 - 2e-6, 30}, Outside::kRefuse).status()));
}

TEST(Triangulation, ExtrapolatesByTheNearestSimplexIfAsked) {
  const Triangulation line = Make(SpaceOf({{10}, {40}, {20}}));
  const Location beyond = Locate(line, {50}, Outside::kExtrapolate);
  EXPECT_TRUE(beyond.is_extrapolated);
  EXPECT_THAT(beyond.weights, ElementsAre(1.5, -0.5));
  const Triangulation corners = Make(GridOf({{0, 1}, {0, 1}}));
  EXPECT_THAT(Locate(corners, {1.25, 0.5}, Outside::kExtrapolate).weights,
              ElementsAre(0.75, 0.0, 0.5));
  EXPECT_FALSE(Locate(corners, {0.25, 0.5}, Outside::kExtrapolate).is_extrapolated);
}

TEST(Triangulation, ExtrapolatesOnBothSidesOfADiagonalAlike) {
  const Triangulation corners = Make(GridOf({{0, 1}, {0, 1}}));
  EXPECT_THAT(Locate(corners, {1.5, 1.25}, Outside::kExtrapolate).weights,
              ElementsAre(0.25, 0.0, 1.25));
  EXPECT_THAT(Locate(corners, {1.25, 1.5}, Outside::kExtrapolate).weights,
              ElementsAre(0.0, 0.25, 1.25));
}

TEST(Triangulation, ReproducesPointsOutside) {
  for (const int d : {1, 2, 3, 4}) {
    const mesh::ParameterSpace space = RandomSpace(d, 12, 4);
    const Triangulation triangulation = Make(space);
    std::mt19937 random(3);
    for (int i = 0; i < 100; ++i) {
      Values point = RandomMixture(space, random);
      for (double& x : point) x = 1.0 + 4.0 * (x - 1.0);
      const Location location = Locate(triangulation, point, Outside::kExtrapolate);
      EXPECT_EQ(location.is_extrapolated, SmallestWeight(location.weights) < -1e-6);
      EXPECT_THAT(BlendOf(space, location.weights), Pointwise(DoubleNear(1e-6), point));
    }
  }
}

TEST(Triangulation, IsContinuousAcrossTheHull) {
  const Triangulation corners = Make(GridOf({{0, 1}, {0, 0.4, 1}, {0, 1}}));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(0.01, 0.99);
  for (int i = 0; i < 300; ++i) {
    Values inside = {anywhere(random), anywhere(random), anywhere(random)};
    inside[i % 3] = i % 2;
    Values outside = inside;
    outside[i % 3] += i % 2 == 0 ? -1e-5 : 1e-5;
    const Location beyond = Locate(corners, outside, Outside::kExtrapolate);
    EXPECT_TRUE(beyond.is_extrapolated);
    EXPECT_THAT(beyond.weights, Pointwise(DoubleNear(1e-4), Locate(corners, inside).weights));
  }
}

TEST(Triangulation, FindsTheNearestPointOfTheHull) {
  const Triangulation tetrahedron = Make(SpaceOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  const auto message = [&](const Values& point) {
    return std::string(tetrahedron.Locate(point, Outside::kRefuse).status().message());
  };
  EXPECT_THAT(message({-1, -1, -1}), HasSubstr("nearest point of it is (p0 0, p1 0, p2 0)"));
  EXPECT_THAT(message({0.25, 0.5, -3}), HasSubstr("by 3 of"));
  EXPECT_THAT(message({0.25, 0.5, -3}), HasSubstr("is (p0 0.25, p1 0.5, p2 0)"));
  EXPECT_THAT(message({1, 1, -5}), HasSubstr("is (p0 0.5, p1 0.5, p2 0)"));
}

// Of a point outside, in parts of the parameters' ranges, as the message tells it.
double ToldDistance(const Triangulation& triangulation, const Values& point) {
  const absl::Status status = triangulation.Locate(point, Outside::kRefuse).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  const std::string message(status.message());
  return std::stod(message.substr(message.find(", by ") + 5));
}

TEST(Triangulation, NoPointOfTheHullIsNearerThanTheNearest) {
  for (const int d : {2, 3, 4}) {
    mesh::ParameterSpace space = RandomSpace(d, 12, 6);
    space.points.emplace_back(d, -3.0);  // so that each parameter runs from -3 to 5
    space.points.emplace_back(d, 5.0);
    const Triangulation triangulation = Make(space);
    std::mt19937 random(2);
    for (int corner = 1; corner + 1 < 1 << d; ++corner) {
      Eigen::VectorXd point(d);
      for (int i = 0; i < d; ++i) point[i] = corner >> i & 1 ? 6.0 : -4.0;
      double nearest = std::numeric_limits<double>::infinity();
      for (int k = 0; k < 3000; ++k) {
        const Values inside = RandomMixture(space, random);
        const Eigen::Map<const Eigen::VectorXd> place(inside.data(), d);
        nearest = std::min(nearest, (place - point).norm() / 8.0);
      }
      const double told = ToldDistance(triangulation, Values(point.data(), point.data() + d));
      EXPECT_LE(told, nearest + 1e-6);  // the message has six digits
      EXPECT_GE(told, 0.8 * nearest);   // mixtures come this close
    }
  }
}

TEST(Triangulation, GivesTheSameWeightsAgain) {
  const mesh::ParameterSpace space = RandomSpace(3, 17, 8);
  const Triangulation first = Make(space);
  const Triangulation second = Make(space);
  std::mt19937 random(3);
  for (int i = 0; i < 50; ++i) {
    const Values point = RandomMixture(space, random);
    EXPECT_EQ(Locate(first, point).weights, Locate(second, point).weights);
  }
}

TEST(Triangulation, RefusesPointsInASubspace) {
  EXPECT_THAT(Refusal(SpaceOf({{0, 0}, {1, 2}, {2, 4}, {0.5, 1}})),
              HasSubstr("lie in a subspace of 1 of the 2 dimensions (p0, p1)"));
  EXPECT_THAT(Refusal(GridOf({{1, 2}, {5}, {0, 1, 4}})), HasSubstr("p1 is 5 for all animations"));
}

TEST(Triangulation, RefusesTooFewPoints) {
  EXPECT_THAT(Refusal(SpaceOf({{0, 0}, {1, 2}})),
              HasSubstr("2 parameters (p0, p1) need at least 3 animations, got 2"));
}

TEST(Triangulation, RefusesTwoPointsAtOnePlace) {
  EXPECT_THAT(Refusal(SpaceOf({{0, 0}, {1, 2}, {3, 1}, {1, 2 + 1e-5}})),
              HasSubstr("points[1] and points[3] are at the same place"));
}

TEST(Triangulation, RefusesValuesBeyondWhatNumbersHold) {
  EXPECT_THAT(Refusal(SpaceOf({{-1.5e308}, {1.5e308}})), HasSubstr("the values of p0 span inf"));
}

// Parameters that were computed need not be alike to the last bit.
TEST(Triangulation, TakesValuesThatDifferByRoundingAsAlike) {
  EXPECT_THAT(Refusal(SpaceOf({{0.3, 1}, {0.1 + 0.2, 2}, {0.3, 3}})),
              HasSubstr("p0 is 0.3 for all animations"));
  const mesh::ParameterSpace corners = SpaceOf({{0.1, 0.3}, {0.7, 0.1 + 0.2}, {0.1, 5}, {0.7, 5}});
  ExpectExactAtAnimations(corners);
  ExpectReproducesPoints(corners);
}

// Where points nearly line up, simplices are left out; what they covered goes to their neighbours.
TEST(Triangulation, HasNoGapsWherePointsNearlyLineUp) {
  std::mt19937 random(1);
  for (const double off : {1e-4, 1e-5, 1e-6, 1e-7, 1e-9, 1e-12, 1e-15}) {
    std::uniform_real_distribution<double> anyhow(-off, off);
    for (int repeat = 0; repeat < 5; ++repeat) {
      mesh::ParameterSpace space = GridOf({{0.0, 0.4, 1.0}, {0.0, 0.5, 1.0}});
      for (Values& point : space.points) {
        for (double& x : point) x += anyhow(random);
      }
      const Triangulation triangulation = Make(space);
      for (int i = 0; i < 50; ++i) {
        const Values point = RandomMixture(space, random);
        const Location location = Locate(triangulation, point);
        EXPECT_THAT(BlendOf(space, location.weights), Pointwise(DoubleNear(1e-7), point));
      }
    }
  }
}

TEST(Triangulation, RefusesWhatIsNoPoint) {
  const Triangulation line = Make(SpaceOf({{10}, {40}}));
  EXPECT_TRUE(absl::IsInvalidArgument(line.Locate(Values{}, Outside::kRefuse).status()));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(absl::IsInvalidArgument(line.Locate(Values{nan}, Outside::kExtrapolate).status()));
  EXPECT_TRUE(absl::IsOutOfRange(line.Locate(Values{1e308}, Outside::kExtrapolate).status()));
}

}  // namespace
}  // namespace liquidblend::parameters

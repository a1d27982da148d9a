#include "core/blend/life_limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/mesh/registered_family.h"

namespace liquidblend::blend {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

constexpr double kNear = 1e-6;
constexpr std::array<float, 3> kLeft = {-1, 0, 2}, kRight = {1, 0, 2};

// A family of 41 frames with so many lists of part lives, a target each.
mesh::RegisteredFamily FamilyOf(std::vector<std::vector<mesh::PartLife>> lives) {
  mesh::RegisteredFamily family;
  family.num_frames = 41;
  family.edge_length_m = 0.1;
  for (std::vector<mesh::PartLife>& of_target : lives) {
    family.targets.emplace_back().report.part_lives = std::move(of_target);
  }
  return family;
}

std::vector<double> Clamped(const LifeLimits& limits, std::vector<double> weights) {
  EXPECT_TRUE(limits.Clamp(weights));
  return weights;
}

void ExpectUnchanged(const LifeLimits& limits, std::vector<double> weights) {
  const std::vector<double> before = weights;
  EXPECT_FALSE(limits.Clamp(weights));
  EXPECT_EQ(weights, before);
}

TEST(LifeLimits, LeaveAPartTwoFrames) {
  const LifeLimits limits(FamilyOf({{{kLeft, 10, 20}}}));
  ExpectUnchanged(limits, {-0.8});  // the part ends at frame 2
  ExpectUnchanged(limits, {2.0});
  EXPECT_THAT(Clamped(limits, {-0.9}), ElementsAre(DoubleNear(-0.8, kNear)));
  const LifeLimits swapped(FamilyOf({{{kLeft, 20, 10}}}));
  EXPECT_THAT(Clamped(swapped, {1.9}), ElementsAre(DoubleNear(1.8, kNear)));
}

TEST(LifeLimits, CountSquaresOfTimesWhereThoseBlend) {
  mesh::RegisteredFamily family = FamilyOf({{{kLeft, 10, 20}}});
  family.rest_time_s = 0.0;
  // 10^2 + w (20^2 - 10^2) = 2^2
  EXPECT_THAT(Clamped(LifeLimits(family), {-0.5}), ElementsAre(DoubleNear(-0.32, kNear)));
}

TEST(LifeLimits, ClampedWeightsStayAsTheyAre) {
  mesh::RegisteredFamily family = FamilyOf({{{kLeft, 9.7, 21.3}}, {{kLeft, 9.7, 13.1}}});
  family.rest_time_s = -0.1;
  const LifeLimits limits(family);
  ExpectUnchanged(limits, Clamped(limits, {-0.7, -0.9}));
}

TEST(LifeLimits, APartThatIsShorterInAnInputIsNotMadeLonger) {
  const LifeLimits limits(FamilyOf({{{kLeft, 1.5, 20}}}));
  ExpectUnchanged(limits, {0.0});
  EXPECT_THAT(Clamped(limits, {-0.1}), ElementsAre(DoubleNear(0.0, kNear)));
}

TEST(LifeLimits, APartThatIsJoinedInTheSourcesFirstFrameHasNoWeightsBelowZero) {
  const LifeLimits limits(FamilyOf({{{kLeft, 0, 20}}}));
  ExpectUnchanged(limits, {0.0});
  ExpectUnchanged(limits, {0.01});
  EXPECT_THAT(Clamped(limits, {-0.25}), ElementsAre(DoubleNear(0.0, kNear)));
}

TEST(LifeLimits, APartOfSeveralTargetsIsOnePart) {
  const std::array<float, 3> nearly_left = {-1.02F, 0, 2};
  const LifeLimits limits(FamilyOf({{{kLeft, 10, 20}}, {{nearly_left, 10, 30}}}));
  ExpectUnchanged(limits, {-0.8, 0.0});
  ExpectUnchanged(limits, {-1.0, 0.5});  // ends at frame 10
  // From (0, 0): 10 + share * (-0.5 * 10 - 0.5 * 20) = 2.
  EXPECT_THAT(Clamped(limits, {-0.5, -0.5}),
              ElementsAre(DoubleNear(-0.5 * 8 / 15, kNear), DoubleNear(-0.5 * 8 / 15, kNear)));
}

TEST(LifeLimits, EachPartHasItsOwn) {
  const LifeLimits limits(FamilyOf({{{kLeft, 10, 20}, {kRight, 20, 10}}}));
  EXPECT_THAT(Clamped(limits, {-1.0}), ElementsAre(DoubleNear(-0.8, kNear)));
  EXPECT_THAT(Clamped(limits, {2.0}), ElementsAre(DoubleNear(1.8, kNear)));
}

TEST(LifeLimits, MoveTowardsBlendsOfTheInputs) {
  const LifeLimits limits(FamilyOf({{{kLeft, 10, 7}}, {{kLeft, 10, 7}}}));
  ExpectUnchanged(limits, {1.0, 1.0});  // ends at frame 4
  // From (0.5, 0.5), frame 7, to (2, 2), frame -2: five ninths of the way.
  constexpr double kExpected = 0.5 + 1.5 * 5 / 9;
  EXPECT_THAT(Clamped(limits, {2.0, 2.0}),
              ElementsAre(DoubleNear(kExpected, kNear), DoubleNear(kExpected, kNear)));
}

TEST(LifeLimits, FamiliesWithoutPartsHaveNone) {
  EXPECT_TRUE(LifeLimits(FamilyOf({{}, {}})).empty());
  ExpectUnchanged(LifeLimits(FamilyOf({{}, {}})), {-1.0, 2.0});
  ExpectUnchanged(LifeLimits(), {-1.0});
}

}  // namespace
}  // namespace liquidblend::blend

#include "worker/registration/features/assignment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace liquidblend::registration {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Assignment, TakesTheLeastTotalAndNotTheNearestFirst) {
  // Places 0 and 10 that moved to 8 and 18: 10 is nearest to 8.
  Eigen::MatrixXd cost(2, 2);
  cost << 0.64, 3.24, 0.04, 0.64;
  const auto pairs = Assign(cost, 9);
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_EQ(pairs[0].column, 0);
  EXPECT_EQ(pairs[1].column, 1);
  EXPECT_GT(pairs[0].confidence, 0.7);
}

TEST(Assignment, TwoWaysAsGoodHaveNoConfidence) {
  const auto pairs = Assign(Eigen::MatrixXd::Constant(2, 2, 0.3), 1);
  ASSERT_EQ(pairs.size(), 2u);
  for (const AssignedPair& pair : pairs) EXPECT_LT(pair.confidence, 1e-6);
}

TEST(Assignment, WhatIsTooFarStaysAlone) {
  Eigen::MatrixXd cost(3, 2);
  cost << 2, 0.1, kInfinity, kInfinity, 0.2, 3;
  const auto pairs = Assign(cost, 1);
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_EQ(pairs[0].row, 0);
  EXPECT_EQ(pairs[0].column, 1);
  EXPECT_NEAR(pairs[0].confidence, 0.9, 1e-6) << "without it the row costs 1 instead of 0.1";
  EXPECT_EQ(pairs[1].row, 2);
  EXPECT_EQ(pairs[1].column, 0);
  EXPECT_TRUE(Assign(Eigen::MatrixXd(0, 3), 1).empty());
  EXPECT_TRUE(Assign(Eigen::MatrixXd(3, 0), 1).empty());
}

TEST(Assignment, TheLargestTablesAreSolved) {
  Eigen::MatrixXd cost(kMaxAssigned, kMaxAssigned);
  for (int i = 0; i < kMaxAssigned; ++i) {
    for (int j = 0; j < kMaxAssigned; ++j)
      cost(i, j) = 0.01 * (i + j + 1 - kMaxAssigned) * (i + j + 1 - kMaxAssigned);
  }
  const auto pairs = Assign(cost, 1);
  ASSERT_EQ(pairs.size(), static_cast<size_t>(kMaxAssigned));
  for (const AssignedPair& pair : pairs) EXPECT_EQ(pair.row + pair.column, kMaxAssigned - 1);
}

}  // namespace
}  // namespace liquidblend::registration

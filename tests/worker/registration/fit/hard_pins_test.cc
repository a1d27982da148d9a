#include "worker/registration/fit/hard_pins.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr float kExact = 1e-4f;  // edges; single precision of moves of some ten edges

class HardPinsTest : public ::testing::Test {
 protected:
  // Far apart, near each other, one free in time, and the first one once more.
  std::vector<Pin> MakePins() const {
    const int32_t v = static_cast<int32_t>(points().cols() / 2);
    int32_t next = v;  // its last neighbour
    for (const int32_t w : sphere_.neighbors[v]) next = w;
    const int32_t far = static_cast<int32_t>(points().cols() / 4);
    return {{v, {3, -2, 1, 2}, true, true, 0},
            {next, {3.2f, -2, 1, 2}, true, true, 1},
            {far, {0, 10, 0, 0}, true, false, 2},
            {v, {3, -2, 1, 0}, true, false, 3}};
  }
  // Terms that ask for something else.
  std::vector<FitTerm> Terms() const {
    std::vector<FitTerm> terms;
    for (int32_t v = 0; v < points().cols(); v += 11) {
      terms.push_back(
          {v, Eigen::Vector4f(0, 0, 0.5f, 0.1f * points()(0, v)), Eigen::Matrix4f::Identity()});
    }
    return terms;
  }
  std::vector<NodeMap> Solve(const SolverOptions& options, const HardPins& pins,
                             int num_threads = 2) const {
    std::vector<NodeMap> maps(nodes_.num_nodes(), NodeMap::Zero());
    const auto solved = Minimize(nodes_, NodeGraph(nodes_), points(), Terms(), pins, options,
                                 parallel::Arena(num_threads), maps);
    EXPECT_TRUE(solved.ok()) << solved.status();
    return maps;
  }
  static SolverOptions Options(int max_direct_rows) {
    SolverOptions options;
    options.smoothness = 0.5;
    options.tolerance = 1e-6;
    options.max_steps = 2000;
    options.max_direct_rows = max_direct_rows;
    return options;
  }
  const Points& points() const { return sphere_.surface.points; }

  TestSurface sphere_{SphereMesh()};
  std::vector<Pin> pins_ = MakePins();
  DeformationNodes nodes_{
      points(), sphere_.neighbors,
      4.0,      std::vector<int32_t>{pins_[0].vertex, pins_[1].vertex, pins_[2].vertex},
      1,        parallel::Arena(2)};
  HardPins held_{nodes_, points(), pins_};
};

TEST_F(HardPinsTest, BothSolversObeyThemExactlyAndAgreeElsewhere) {
  const auto iterative = Solve(Options(0), held_);
  const auto direct = Solve(Options(1 << 20), held_);
  for (const auto& maps : {iterative, direct}) {
    EXPECT_LT(held_.Miss(maps).cwiseAbs().maxCoeff(), kExact);
  }
  for (int64_t v = 0; v < points().cols(); ++v) {
    EXPECT_NEAR((DisplacementOf(nodes_, iterative, points(), v) -
                 DisplacementOf(nodes_, direct, points(), v))
                    .norm(),
                0, 5e-3f);
  }
}

TEST_F(HardPinsTest, TheFreeTimeOfASpacePinIsLeftToTheOthers) {
  const auto maps = Solve(Options(0), held_);
  const Eigen::Vector4f moved = DisplacementOf(nodes_, maps, points(), pins_[2].vertex);
  EXPECT_NEAR((moved.head<3>() - pins_[2].goal.head<3>()).norm(), 0, kExact);
  EXPECT_GT(std::abs(moved[3]), 0.01f);
}

TEST_F(HardPinsTest, SameMapsAtAnyThreadCount) {
  const auto one = Solve(Options(0), held_, 1);
  for (const int num_threads : {2, 8}) EXPECT_EQ(Solve(Options(0), held_, num_threads), one);
}

TEST_F(HardPinsTest, PinsAloneDetermineASmoothField) {
  std::vector<NodeMap> maps(nodes_.num_nodes(), NodeMap::Zero());
  for (const int max_direct_rows : {0, 1 << 20}) {
    const auto solved = Minimize(nodes_, NodeGraph(nodes_), points(), {}, held_,
                                 Options(max_direct_rows), parallel::Arena(2), maps);
    ASSERT_TRUE(solved.ok()) << solved.status();
    EXPECT_LT(held_.Miss(maps).cwiseAbs().maxCoeff(), 1e-3);
  }
}

TEST_F(HardPinsTest, RestoringMovesThePinsBackAndTearsNothing) {
  Points displacement = Deform(nodes_, Solve(Options(0), held_), points(), parallel::Arena(2));
  displacement -= points();
  const Points before = displacement;
  const Eigen::Vector4f drift(0.3f, -0.2f, 0.4f, 0.1f);
  displacement.colwise() += drift;
  ASSERT_TRUE(held_.Restore(nodes_, parallel::Arena(2), displacement).ok());
  for (const Pin& pin : {pins_[0], pins_[1]}) {
    EXPECT_EQ(displacement.col(pin.vertex), pin.goal);
  }
  EXPECT_EQ(displacement.col(pins_[2].vertex).head<3>(), pins_[2].goal.head<3>());
  EXPECT_NEAR(displacement(3, pins_[2].vertex) - before(3, pins_[2].vertex), drift[3], 0.05f);
  const Points change = displacement - before;
  for (int64_t v = 0; v < points().cols(); ++v) {
    for (const int32_t w : sphere_.neighbors[v]) {
      const float distance = (points().col(v) - points().col(w)).norm();
      EXPECT_LT((change.col(v) - change.col(w)).norm(), 0.3f * drift.norm() * distance + 0.01f);
    }
  }
}

TEST_F(HardPinsTest, NamesTheTwoThatContradictEachOther) {
  EXPECT_TRUE(CheckContradictions(pins_, points(), 0.1).ok());
  std::vector<Pin> pins = pins_;
  pins.push_back(pins_[0]);
  pins.back().goal[1] += 0.01f;
  pins.back().correspondence = 7;
  EXPECT_THAT(CheckContradictions(pins, points(), 0.1).message(),
              AllOf(HasSubstr("correspondences 0 and 7"), HasSubstr("contradict")));
  pins.back().hard = false;
  EXPECT_TRUE(CheckContradictions(pins, points(), 0.1).ok());
}

}  // namespace
}  // namespace liquidblend::registration

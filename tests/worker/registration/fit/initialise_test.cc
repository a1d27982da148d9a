#include "worker/registration/fit/initialise.h"

#include <gtest/gtest.h>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

class DiffusePinsTest : public ::testing::Test {
 protected:
  std::vector<NodeMap> Diffuse(const std::vector<Pin>& pins, int passes,
                               int num_threads = 2) const {
    std::vector<NodeMap> maps(nodes_.num_nodes(), NodeMap::Zero());
    DiffusePins(nodes_, graph_, sphere_.surface, pins, passes, parallel::Arena(num_threads), maps);
    return maps;
  }
  // Of a node in the middle, not in an end slab.
  Pin MiddlePin() const {
    const int32_t v = nodes_.vertex(nodes_.num_nodes() / 2);
    return {v, {2, 0, 1, 3}, true, true, 0};
  }

  TestSurface sphere_{SphereMesh()};
  DeformationNodes nodes_{sphere_.surface.points, sphere_.neighbors, 3.0, {}, 1,
                          parallel::Arena(2)};
  NodeGraph graph_{nodes_};
};

TEST_F(DiffusePinsTest, HoldsThePinAndFallsOffWithDistance) {
  const Pin pin = MiddlePin();
  const auto maps = Diffuse({pin}, 20);
  double near_sum = 0, far_sum = 0;
  int num_near = 0, num_far = 0;
  for (int64_t n = 0; n < nodes_.num_nodes(); ++n) {
    EXPECT_TRUE(maps[n].leftCols<4>().isZero());
    const Eigen::Vector4f move = maps[n].col(4);
    if (nodes_.vertex(n) == pin.vertex) {
      EXPECT_EQ(move, pin.goal);
      continue;
    }
    EXPECT_LE(move.norm(), pin.goal.norm());  // no new extremes
    const float distance =
        (nodes_.position(n) - sphere_.surface.points.col(pin.vertex)).head<3>().norm();
    (distance < 5 ? near_sum : far_sum) += move[0];
    ++(distance < 5 ? num_near : num_far);
  }
  ASSERT_GT(num_near, 0);
  ASSERT_GT(num_far, 0);
  EXPECT_GT(near_sum / num_near, 1.3 * far_sum / num_far);
}

TEST_F(DiffusePinsTest, NothingMovesOutOfReachOfThePasses) {
  const auto maps = Diffuse({MiddlePin()}, 0);
  int num_moved = 0;
  for (const NodeMap& map : maps) num_moved += map.isZero() ? 0 : 1;
  EXPECT_EQ(num_moved, 1);
}

TEST_F(DiffusePinsTest, TheEndsOfTimeStayAndASpacePinIsFreeInTime) {
  Pin pin = MiddlePin();
  for (const NodeMap& map : Diffuse({pin}, 50)) EXPECT_TRUE(map.allFinite());
  const auto maps = Diffuse({pin}, 50);
  for (int64_t n = 0; n < nodes_.num_nodes(); ++n) {
    const int32_t v = nodes_.vertex(n);
    if (!sphere_.surface.InFirstSlab(v) && !sphere_.surface.InLastSlab(v)) continue;
    EXPECT_EQ(maps[n](3, 4), 0.0f);
    EXPECT_NE(maps[n](0, 4), 0.0f);
  }
  pin.in_time = false;
  for (const NodeMap& map : Diffuse({pin}, 50)) EXPECT_EQ(map(3, 4), 0.0f);
}

TEST_F(DiffusePinsTest, SameBytesAtAnyThreadCount) {
  EXPECT_EQ(Diffuse({MiddlePin()}, 30, 1), Diffuse({MiddlePin()}, 30, 8));
}

TEST_F(DiffusePinsTest, GoesOnFromTheMapsGiven) {
  const Pin pin = MiddlePin();
  std::vector<NodeMap> maps(nodes_.num_nodes(), NodeMap::Zero());
  for (NodeMap& map : maps) map.col(4) = pin.goal;  // already there
  const auto before = maps;
  DiffusePins(nodes_, graph_, sphere_.surface, {pin}, 10, parallel::Arena(2), maps);
  for (size_t n = 0; n < maps.size(); ++n) EXPECT_NEAR((maps[n] - before[n]).norm(), 0, 1e-5f);
}

}  // namespace
}  // namespace liquidblend::registration

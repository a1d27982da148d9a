#include "worker/registration/fit/coarse_solver.h"

#include <gtest/gtest.h>

#include <cstring>

#include "tests/worker/registration/drops_testing.h"
#include "worker/registration/fit/hard_pins.h"

namespace liquidblend::registration {
namespace {

class CoarseSolverTest : public ::testing::Test {
 protected:
  std::vector<FitTerm> Terms() const {
    std::vector<FitTerm> terms;
    for (int32_t v = 0; v < sphere_.surface.points.cols(); v += 7) {
      const Eigen::Vector4f n = sphere_.mesh.normals.col(v);
      terms.push_back({v, n, 0.1f * Eigen::Matrix4f::Identity() + n * n.transpose()});
    }
    return terms;
  }
  NodeGroups Group(int count) const {
    const std::vector<char> all_held(nodes_.num_nodes(), 1);
    return GroupNodes(nodes_, graph_, all_held, count, 8);
  }
  // 20 columns per group: the maps of its nodes that a component of its map makes.
  Eigen::MatrixXd Prolongation(const NodeGroups& groups) const {
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(20 * nodes_.num_nodes(), 20 * groups.size());
    for (int64_t n = 0; n < nodes_.num_nodes(); ++n) {
      for (int k = 0; k < 20; ++k) {
        NodeMap map = NodeMap::Zero();
        map(k % 4, k / 4) = 1;
        map.col(4) += map.leftCols<4>() * groups.offset.col(n);
        all.block<20, 1>(20 * n, 20 * groups.of_node[n] + k) =
            Eigen::Map<const Eigen::Matrix<float, 20, 1>>(map.data()).cast<double>();
      }
    }
    return all;
  }

  TestSurface sphere_{SphereMesh()};
  DeformationNodes nodes_{sphere_.surface.points, sphere_.neighbors, 2.0, {}, 1,
                          parallel::Arena(2)};
  NodeGraph graph_{nodes_};
};

TEST_F(CoarseSolverTest, GroupsAreOfLikeSizeAndHaveEachNodeOnce) {
  const NodeGroups groups = Group(16);
  ASSERT_EQ(groups.size(), 16);
  std::vector<int> count(nodes_.num_nodes(), 0);
  for (int32_t c = 0; c < 16; ++c) {
    EXPECT_NEAR(static_cast<double>(groups.nodes[c].size()),
                static_cast<double>(nodes_.num_nodes()) / 16, 1.0);
    for (const int32_t n : groups.nodes[c]) {
      ++count[n];
      EXPECT_EQ(groups.of_node[n], c);
    }
  }
  EXPECT_EQ(count, std::vector<int>(nodes_.num_nodes(), 1));
}

TEST_F(CoarseSolverTest, TheGroupsEquationsAreThoseOfTheNodesRestricted) {
  const SolverOptions options = {.smoothness = 50, .damping = 1e-9};
  const parallel::Arena arena(2);
  const std::vector<FitTerm> terms = Terms();
  const NormalEquations equations(nodes_, graph_, sphere_.surface.points, terms, options, arena);
  const NodeGroups groups = Group(4);
  const Eigen::MatrixXd matrix =
      Eigen::MatrixXd(equations.Assemble()).selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd all = Prolongation(groups);
  const Eigen::MatrixXd expected = all.transpose() * matrix * all;
  const Eigen::MatrixXd lower = equations.AssembleFor(groups, arena);
  const Eigen::MatrixXd found = lower.selfadjointView<Eigen::Lower>();
  EXPECT_LT((found - expected).norm(), 1e-5 * expected.norm());
}

TEST_F(CoarseSolverTest, StiffSurfacesTakeFewSteps) {
  std::vector<NodeMap> maps(nodes_.num_nodes(), NodeMap::Zero());
  const auto solved = Minimize(nodes_, graph_, sphere_.surface.points, Terms(), HardPins(),
                               {.smoothness = 500, .max_direct_rows = 0}, parallel::Arena(2), maps);
  ASSERT_TRUE(solved.ok()) << solved.status();
  EXPECT_LE(solved->num_steps, 60);  // 26; 193 without
}

// Two drops above a pool that moves; nothing says where the one is to go, little holds the other.
TEST(CoarseSolver, WhatIsHeldByNothingOrLittleStaysWhereItIs) {
  const TestSurface scene(Scene({DropAt(-0.6, 0.95), DropAt(0.6, 0.95)}));
  const parallel::Arena arena(2);
  const DeformationNodes nodes(scene.surface.points, scene.neighbors, 2.0, {}, 1, arena);
  const NodeGraph graph(nodes);
  const double edge = scene.mesh.edge_length_m;
  std::vector<FitTerm> terms;
  for (int32_t v = 0; v < scene.surface.points.cols(); v += 5) {
    const Eigen::Vector3f place = static_cast<float>(edge) * scene.surface.points.col(v).head<3>();
    if (place[2] < 0.1f) {
      terms.push_back({v, Eigen::Vector4f(10, 0, 0, 0), Eigen::Matrix4f::Identity()});
    } else if (place[0] > 0) {
      terms.push_back({v, Eigen::Vector4f::Zero(), 1e-4f * Eigen::Matrix4f::Identity()});
    }
  }
  std::vector<NodeMap> maps(nodes.num_nodes(), NodeMap::Zero());
  const auto solved =
      Minimize(nodes, graph, scene.surface.points, terms, HardPins(),
               {.smoothness = 500, .max_steps = 4000, .max_direct_rows = 0}, arena, maps);
  ASSERT_TRUE(solved.ok()) << solved.status();
  int num_drops = 0;
  for (int64_t n = 0; n < nodes.num_nodes(); ++n) {
    const bool is_drop = edge * nodes.position(n)[2] > 0.1;
    num_drops += is_drop ? 1 : 0;
    EXPECT_NEAR(maps[n](0, 4), is_drop ? 0 : 10, 0.2) << edge * nodes.position(n).transpose();
  }
  EXPECT_GT(num_drops, 50);
}

TEST_F(CoarseSolverTest, SameBytesAtAnyThreadCount) {
  std::vector<NodeMap> first;
  for (const int num_threads : {1, 2, 8}) {
    std::vector<NodeMap> maps(nodes_.num_nodes(), NodeMap::Zero());
    const auto solved =
        Minimize(nodes_, graph_, sphere_.surface.points, Terms(), HardPins(),
                 {.smoothness = 100, .max_direct_rows = 0}, parallel::Arena(num_threads), maps);
    ASSERT_TRUE(solved.ok()) << solved.status();
    if (num_threads == 1) first = maps;
    EXPECT_EQ(std::memcmp(first.data(), maps.data(), maps.size() * sizeof(NodeMap)), 0);
  }
}

TEST_F(CoarseSolverTest, FewNodesDoWithout) {
  const parallel::Arena arena(1);
  const DeformationNodes few(sphere_.surface.points, sphere_.neighbors, 6.0, {}, 1, arena);
  const NodeGraph graph(few);
  const std::vector<FitTerm> terms = Terms();
  const NormalEquations equations(few, graph, sphere_.surface.points, terms, {}, arena);
  EXPECT_FALSE(CoarseSolver::Make(few, equations, arena).has_value());
}

}  // namespace
}  // namespace liquidblend::registration

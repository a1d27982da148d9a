#include "worker/registration/fit/deformation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

constexpr double kSpacing = 3.0;

class DeformationNodesTest : public ::testing::Test {
 protected:
  DeformationNodes Make(int num_threads, std::span<const int32_t> first = {},
                        uint64_t seed = 1) const {
    return {sphere_.surface.points,      sphere_.neighbors, kSpacing, first, seed,
            parallel::Arena(num_threads)};
  }
  TestSurface sphere_{SphereMesh()};
};

TEST_F(DeformationNodesTest, WeightsAddUpToOneAndEveryVertexHasANode) {
  const DeformationNodes nodes = Make(2);
  for (int64_t v = 0; v < sphere_.surface.points.cols(); ++v) {
    float sum = 0;
    for (const Influence& influence : nodes.influences(v)) {
      EXPECT_GE(influence.weight, 0.0f);
      sum += influence.weight;
    }
    EXPECT_NEAR(sum, 1.0f, 1e-5f);
  }
}

TEST_F(DeformationNodesTest, AreNoCloserThanTheSpacing) {
  const DeformationNodes nodes = Make(2);
  ASSERT_GT(nodes.num_nodes(), 4);
  GeodesicSearch search(sphere_.surface.points, sphere_.neighbors);
  for (int64_t n = 0; n < nodes.num_nodes(); ++n) {
    const auto& near = search.From(nodes.vertex(n), static_cast<float>(kSpacing));
    ASSERT_GT(near.size(), 1u);  // more than the node's own vertex
    for (const auto& reached : near) {
      for (int64_t m = 0; m < nodes.num_nodes(); ++m) {
        if (m != n) {
          EXPECT_NE(reached.vertex, nodes.vertex(m));
        }
      }
    }
  }
}

TEST_F(DeformationNodesTest, StandAtTheVerticesAskedFor) {
  const std::vector<int32_t> wanted = {17, 400};
  const DeformationNodes nodes = Make(1, wanted);
  for (const int32_t v : wanted) {
    bool found = false;
    for (int64_t n = 0; n < nodes.num_nodes(); ++n) found |= nodes.vertex(n) == v;
    EXPECT_TRUE(found) << v;
  }
}

TEST_F(DeformationNodesTest, AreTheSameAtAnyThreadCountAndOthersForAnotherSeed) {
  const DeformationNodes one = Make(1), eight = Make(8), other = Make(1, {}, 2);
  ASSERT_EQ(one.num_nodes(), eight.num_nodes());
  bool differs = one.num_nodes() != other.num_nodes();
  for (int64_t n = 0; n < one.num_nodes(); ++n) {
    EXPECT_EQ(one.vertex(n), eight.vertex(n));
    if (!differs) differs = one.vertex(n) != other.vertex(n);
  }
  EXPECT_TRUE(differs);
  for (int64_t v = 0; v < sphere_.surface.points.cols(); ++v) {
    const auto a = one.influences(v), b = eight.influences(v);
    ASSERT_EQ(a.size(), b.size());
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), [](Influence x, Influence y) {
      return x.node == y.node && x.weight == y.weight;
    }));
  }
}

TEST_F(DeformationNodesTest, ArePlacedAsOneByOne) {
  const int64_t count = sphere_.surface.points.cols();
  std::vector<int32_t> order(count), expected;
  std::iota(order.begin(), order.end(), 0);
  Random random(1);
  for (int64_t n = count - 1; n > 0; --n) std::swap(order[n], order[random.Below(n + 1)]);
  std::vector<char> covered(count, 0);
  GeodesicSearch search(sphere_.surface.points, sphere_.neighbors);
  for (const int32_t v : order) {
    if (covered[v] != 0) continue;
    expected.push_back(v);
    for (const auto& reached : search.From(v, static_cast<float>(kSpacing))) {
      covered[reached.vertex] = 1;
    }
  }
  std::sort(expected.begin(), expected.end());
  const DeformationNodes nodes = Make(8);
  std::vector<int32_t> placed;
  for (int64_t n = 0; n < nodes.num_nodes(); ++n) placed.push_back(nodes.vertex(n));
  EXPECT_EQ(placed, expected);
}

TEST_F(DeformationNodesTest, MayBeMoreThan16BitsTellApart) {
  constexpr int32_t kCount = 70000;  // along a line, each a node that reaches the next ones
  Points line = Points::Zero(4, kCount);
  for (int32_t v = 0; v < kCount; ++v) line(0, v) = static_cast<float>(v);
  const PackedLists neighbors(kCount, parallel::Arena(2), [](int64_t row, auto& list) {
    const auto v = static_cast<int32_t>(row);
    if (v > 0) list.push_back(v - 1);
    if (v + 1 < kCount) list.push_back(v + 1);
  });
  const DeformationNodes nodes(line, neighbors, 0.6, {}, 1, parallel::Arena(2));
  ASSERT_EQ(nodes.num_nodes(), kCount);
  for (int32_t v = 1; v + 1 < kCount; ++v) {
    std::vector<int32_t> reached;
    for (const Influence& influence : nodes.influences(v)) reached.push_back(influence.node);
    ASSERT_THAT(reached, testing::ElementsAre(v - 1, v, v + 1));
  }
}

TEST_F(DeformationNodesTest, ReproduceAnAffineMapOfSpaceTime) {
  const DeformationNodes nodes = Make(2);
  Eigen::Matrix4f linear = Eigen::Matrix4f::Zero();
  linear(0, 3) = 0.4f;
  linear(1, 1) = -0.2f;
  const Eigen::Vector4f shift(1, 2, 3, 0.5f);
  std::vector<NodeMap> maps(nodes.num_nodes());
  for (int64_t n = 0; n < nodes.num_nodes(); ++n) {
    maps[n].leftCols<4>() = linear;
    maps[n].col(4) = linear * nodes.position(n) + shift;
  }
  const Points deformed = Deform(nodes, maps, sphere_.surface.points, parallel::Arena(2));
  for (int64_t v = 0; v < deformed.cols(); ++v) {
    const Eigen::Vector4f p = sphere_.surface.points.col(v);
    EXPECT_NEAR((deformed.col(v) - (p + linear * p + shift)).norm(), 0, 1e-3f);
  }
}

}  // namespace
}  // namespace liquidblend::registration

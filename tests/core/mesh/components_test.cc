#include "core/mesh/components.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/synthetic/shapes.h"

namespace liquidblend::mesh {
namespace {

TEST(Components, AreMeasuredOneByOneInTheOrderOfTheirTriangles) {
  const TriangleMesh parts[] = {synthetic::Box({1, 2, 3}, {2, 4, 6}, 4),
                                synthetic::Icosphere({-5, 0, 0}, 0.5, 4)};
  const std::vector<Component> found = FindComponents(synthetic::Join(parts));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].volume, 6.0, 1e-5);
  EXPECT_NEAR(found[0].area, 22.0, 1e-5);
  EXPECT_LT((found[0].centre - Eigen::Vector3d(1.5, 3, 4.5)).norm(), 1e-5);
  EXPECT_NEAR(found[1].volume, Volume(parts[1]), 1e-6);
  EXPECT_LT((found[1].centre - Eigen::Vector3d(-5, 0, 0)).norm(), 1e-5);
}

TEST(Components, ABubbleHasANegativeVolume) {
  const std::vector<Component> found =
      FindComponents(synthetic::BallWithBubble({0, 0, 0}, 1.0, 0.5, 4));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_GT(std::max(found[0].volume, found[1].volume), 3.5);
  EXPECT_NEAR(std::min(found[0].volume, found[1].volume), -0.52, 0.03);
}

TEST(Components, NothingHasNone) { EXPECT_TRUE(FindComponents({}).empty()); }

}  // namespace
}  // namespace liquidblend::mesh

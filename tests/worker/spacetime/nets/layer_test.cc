#include "worker/spacetime/nets/layer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/spacetime/field/grid_testing.h"

namespace liquidblend::spacetime::layer_test {
namespace {

constexpr int kSide = 32;

GridSurface Ball(const Eigen::Vector3f& centre, double radius) {
  return InGrid(synthetic::Icosphere(centre, radius, 5));
}

TEST(Layer, HasTheSignedDistanceAndItsGradient) {
  const Eigen::Vector3f centre(15.3f, 15.7f, 15.1f);
  const Layer layer(CubeGrid(kSide), {CubeGrid(kSide), Ball(centre, 8)});
  int num_near = 0;
  for (int k = 2; k < 30; ++k) {
    for (int j = 2; j < 30; ++j) {
      for (int i = 2; i < 30; ++i) {
        const Eigen::Vector3f offset = PointAt(i, j, k) - centre;
        const float distance = offset.norm() - 8;
        if (std::abs(distance) > 1) continue;
        ++num_near;
        EXPECT_NEAR(layer.Distance(i, j, k), distance, 0.02f);
        EXPECT_EQ(layer.Distance(i, j, k) < 0, layer.inside().At(i, j, k));
        EXPECT_GT(layer.Gradient(i, j, k).dot(offset.normalized()), 0.98f);
      }
    }
  }
  EXPECT_GT(num_near, 1000);
}

// Two views of one moment that disagree a little: the mean is between them.
TEST(Layer, BlendsTwoSurfaces) {
  const Eigen::Vector3f centre(15.3f, 15.7f, 15.1f);
  const Grid grid = CubeGrid(kSide);
  const Layer layer(grid, {grid, Ball(centre, 7), Ball(centre, 9), 0.25f});
  for (int i = 2; i < 30; ++i) {
    const float distance = (PointAt(i, 15, 15) - centre).norm() - 7.5f;
    if (std::abs(distance) > 1) continue;
    EXPECT_NEAR(layer.Distance(i, 15, 15), distance, 0.03f);
    EXPECT_EQ(layer.Distance(i, 15, 15) < 0, layer.inside().At(i, 15, 15));
  }
}

TEST(Layer, NothingIsKnownFarFromTheSurface) {
  const Layer layer(CubeGrid(kSide), {CubeGrid(kSide), Ball({15, 15, 15}, 4)});
  EXPECT_GE(layer.Distance(1, 1, 1), DistanceBand::kBandWidth);
  EXPECT_EQ(layer.Gradient(1, 1, 1).norm(), 0);
}

}  // namespace
}  // namespace liquidblend::spacetime::layer_test

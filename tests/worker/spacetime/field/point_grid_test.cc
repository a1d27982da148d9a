#include "worker/spacetime/field/point_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace liquidblend::spacetime {
namespace {

std::vector<int32_t> Near(const PointGrid& grid, const Eigen::Vector3f& at) {
  std::vector<int32_t> near;
  grid.ForEachNear(at, [&](int32_t index) { near.push_back(index); });
  return near;
}

TEST(PointGrid, FindsEachPointWithinTheRadiusOnce) {
  constexpr float kRadius = 0.2f;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<float> one(-1.0f, 1.0f);
  const auto point = [&] { return Eigen::Vector3f(one(random), one(random), one(random)); };
  Eigen::Matrix3Xf points(3, 500);
  for (int64_t p = 0; p < points.cols(); ++p) points.col(p) = point();
  const PointGrid grid(points, kRadius);
  size_t num_found = 0;
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3f at = point();
    std::vector<int32_t> expected;
    for (int32_t p = 0; p < points.cols(); ++p) {
      if ((points.col(p) - at).squaredNorm() < kRadius * kRadius) expected.push_back(p);
    }
    std::vector<int32_t> found = Near(grid, at);
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected);
    num_found += found.size();
  }
  EXPECT_GT(num_found, 100u);
}

TEST(PointGrid, TakesAnyFinitePosition) {
  Eigen::Matrix3Xf points(3, 2);
  points << 1e38f, 0, -1e38f, 0, 1e38f, 0;
  const PointGrid grid(points, 1e-3f);
  EXPECT_EQ(Near(grid, points.col(1)), std::vector<int32_t>{1});
  EXPECT_TRUE(Near(grid, {-1e38f, -1e38f, 0}).empty());
  EXPECT_TRUE(Near(PointGrid(Eigen::Matrix3Xf(3, 0), 1.0f), {0, 0, 0}).empty());
}

}  // namespace
}  // namespace liquidblend::spacetime

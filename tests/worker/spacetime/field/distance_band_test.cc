#include "worker/spacetime/field/distance_band.h"

#include <gtest/gtest.h>

#include "tests/worker/spacetime/field/grid_testing.h"

namespace liquidblend::spacetime::distance_band_test {
namespace {

constexpr int kSide = 40;

float BruteForce(const GridSurface& surface, const Eigen::Vector3f& p) {
  float best = std::numeric_limits<float>::infinity();
  for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
    Eigen::Matrix3f corners;
    for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(surface.triangles(c, t));
    const Eigen::Vector3f w = ClosestBarycentric(p, corners.col(0), corners.col(1), corners.col(2));
    best = std::min(best, (p - corners * w).norm());
  }
  return best;
}

TEST(DistanceBand, IsExactNextToTheSurfaceAndNearlySoInTheBand) {
  const Grid grid = CubeGrid(kSide);
  const GridSurface surface = InGrid(synthetic::Torus({20, 20, 20}, 10, 4, 40, 20));
  const DistanceBand band(grid, surface);
  for (int k = 0; k < kSide; k += 2) {
    for (int j = 1; j < kSide; j += 2) {
      for (int i = 0; i < kSide; i += 3) {
        const float exact = BruteForce(surface, PointAt(i, j, k));
        const float found = band.Distance(i, j, k);
        if (exact < 1.0f) {
          EXPECT_NEAR(found, exact, 1e-5f) << i << ' ' << j << ' ' << k;
        }
        if (exact < 3.0f) {
          EXPECT_NEAR(found, exact, 0.15f) << i << ' ' << j << ' ' << k;
        }
        EXPECT_GE(found, std::min(exact, DistanceBand::kBandWidth) - 1e-4f);
      }
    }
  }
}

TEST(DistanceBand, FarFromTheSurfaceThereIsNoTriangle) {
  const Grid grid = CubeGrid(kSide);
  const DistanceBand band(grid, InGrid(synthetic::Icosphere({20, 20, 20}, 5, 3)));
  EXPECT_EQ(band.Triangle(2, 2, 2), -1);
  EXPECT_EQ(band.Distance(2, 2, 2), DistanceBand::kBandWidth);
  EXPECT_GE(band.Triangle(25, 20, 20), 0);
}

TEST(DistanceBand, KnowsWhatIsNeededAsIfItKnewAll) {
  const Grid grid = CubeGrid(kSide);
  const GridSurface surface = InGrid(synthetic::Icosphere({20, 20, 20}, 9, 4));
  PointBits needed(grid);
  const int lo = 8, hi = 17;
  for (int k = lo; k <= hi; ++k) {
    for (int j = lo; j <= hi; ++j) {
      for (int i = lo; i <= hi; ++i) needed.Set(grid, i, j, k);
    }
  }
  const DistanceBand all(grid, surface), some(grid, surface, &needed);
  int num_known = 0, num_far = 0;
  for (int k = lo; k <= hi; ++k) {
    for (int j = lo; j <= hi; ++j) {
      for (int i = lo; i <= hi; ++i) {
        const float expected = all.Distance(i, j, k);
        const float tolerance = expected <= 1.0f ? 0.0f : 0.1f;  // handed on by other neighbours
        EXPECT_NEAR(some.Distance(i, j, k), expected, tolerance) << i << ' ' << j << ' ' << k;
        EXPECT_EQ(some.Triangle(i, j, k) < 0, all.Triangle(i, j, k) < 0);
        if (all.Triangle(i, j, k) < 0) continue;
        ++num_known;
        num_far += expected > 2.0f ? 1 : 0;
      }
    }
  }
  EXPECT_GT(num_known, 100);
  EXPECT_GT(num_far, 10);
  EXPECT_GE(all.Triangle(29, 20, 20), 0);
  EXPECT_EQ(some.Triangle(29, 20, 20), -1) << "far from what is needed";
}

// A point that nothing on the way to the surface is needed for.
TEST(DistanceBand, FindsTheWayToASinglePoint) {
  const Grid grid = CubeGrid(kSide);
  const GridSurface surface = InGrid(synthetic::Icosphere({20, 20, 20}, 9, 4));
  PointBits needed(grid);
  needed.Set(grid, 32, 20, 20);
  EXPECT_EQ(DistanceBand(grid, surface).Triangle(34, 20, 20), -1);
  const DistanceBand band(grid, surface, &needed);
  EXPECT_NEAR(band.Distance(32, 20, 20), 3.0f, 0.05f);
}

TEST(ClosestBarycentric, FindsFacesEdgesCornersAndSurvivesTrianglesWithoutArea) {
  const Eigen::Vector3f a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  EXPECT_TRUE(
      ClosestBarycentric({0.25f, 0.25f, 3}, a, b, c).isApprox(Eigen::Vector3f(0.5f, 0.25f, 0.25f)));
  EXPECT_TRUE(ClosestBarycentric({0.5f, -1, 0}, a, b, c).isApprox(Eigen::Vector3f(0.5f, 0.5f, 0)));
  EXPECT_TRUE(ClosestBarycentric({-1, -1, 0}, a, b, c).isApprox(Eigen::Vector3f(1, 0, 0)));
  EXPECT_TRUE(ClosestBarycentric({1, 1, 1}, a, a, a).allFinite());
  EXPECT_TRUE(ClosestBarycentric({2, 1, 0}, a, b, 2 * b).allFinite());
}

}  // namespace
}  // namespace liquidblend::spacetime::distance_band_test

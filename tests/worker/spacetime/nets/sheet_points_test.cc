#include "worker/spacetime/nets/sheet_points.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "tests/synthetic/sheet.h"
#include "tests/worker/spacetime/field/grid_testing.h"
#include "worker/spacetime/nets/layer.h"

namespace liquidblend::spacetime::sheet_points_test {
namespace {

constexpr int kSide = 40;
constexpr float kRadius = 10.0f;
const Eigen::Vector3f kCentre(19.3f, 19.6f, 19.3f);

Eigen::Matrix3f Towards(const Eigen::Vector3f& normal) {
  return Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), normal).toRotationMatrix();
}

GridSurface SheetInGrid(double thickness, double bend, const Eigen::Vector3f& normal) {
  mesh::TriangleMesh sheet = synthetic::Sheet(
      {.radius_m = kRadius, .thickness_m = thickness, .edge_m = 1.1, .bend_m = bend});
  const Eigen::Matrix3Xf turned = Towards(normal) * sheet.vertices;
  sheet.vertices = turned.colwise() + kCentre;
  return InGrid(sheet);
}

// Faces of the grid of which two opposite corners are inside and the two others are not.
int NumCheckerboards(const InsideBits& inside) {
  int count = 0;
  for (int n = 0; n < (kSide - 1) * (kSide - 1) * (kSide - 1); ++n) {
    const Eigen::Vector3i p(n % (kSide - 1), n / (kSide - 1) % (kSide - 1),
                            n / (kSide - 1) / (kSide - 1));
    const auto at = [&](const Eigen::Vector3i& q) { return inside.At(q.x(), q.y(), q.z()); };
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3i a = Eigen::Vector3i::Unit(axis),
                            b = Eigen::Vector3i::Unit((axis + 1) % 3);
      if (at(p) == at(p + a + b) && at(p + a) == at(p + b) && at(p) != at(p + a)) ++count;
    }
  }
  return count;
}

TEST(SheetPoints, OrdinarySurfacesHaveNone) {
  const Grid grid = CubeGrid(kSide);
  const GridSurface surfaces[] = {InGrid(synthetic::Icosphere(kCentre, 8, 4)),
                                  InGrid(synthetic::Icosphere(kCentre, 2, 2)),
                                  InGrid(synthetic::Torus(kCentre, 8, 3, 40, 20)),
                                  InGrid(synthetic::Box({8, 8, 8}, {20.02f, 20.5f, 20.5f}, 8)),
                                  SheetInGrid(2.0, 0.0, {0.3f, 0.4f, 0.5f})};
  for (const GridSurface& surface : surfaces) {
    EXPECT_EQ(FindSheetPoints(grid, surface, 0).size(), 0U);
  }
}

TEST(SheetPoints, AStillSheetAlongTheGridHasOneLayerOfThem) {
  const std::vector<SheetPoint> points =
      FindSheetPoints(CubeGrid(kSide), SheetInGrid(0.3, 0.0, Eigen::Vector3f::UnitZ()), 0);
  EXPECT_NEAR(static_cast<double>(points.size()), 314, 10);
  for (const SheetPoint& p : points) {
    EXPECT_EQ(p.k, 19);
    EXPECT_NEAR(p.thickness, 0.3f, 1e-4f);
  }
}

TEST(SheetPoints, AFastOneHasMore) {
  GridSurface sheet = SheetInGrid(0.3, 0.0, Eigen::Vector3f::UnitZ());
  sheet.velocities = Eigen::Vector3f(0, 0, 4).replicate(1, sheet.vertices.cols());
  for (const SheetPoint& p : FindSheetPoints(CubeGrid(kSide), sheet, 0.25f)) {
    EXPECT_LE(std::abs(static_cast<float>(p.k) - kCentre.z()), 1.2f);
  }
  EXPECT_GT(FindSheetPoints(CubeGrid(kSide), sheet, 0.25f).size(), 600U);
}

TEST(SheetPoints, AreNearTheSheetAndNotBeyondItsRim) {
  for (const Eigen::Vector3f& normal :
       {Eigen::Vector3f(0.2f, 0.35f, 1), Eigen::Vector3f(1, 1, 0.1f),
        Eigen::Vector3f(1, 1.1f, -0.95f)}) {
    const Eigen::Matrix3f turn = Towards(normal);
    const auto points = FindSheetPoints(CubeGrid(kSide), SheetInGrid(0.3, 0.0, normal), 0);
    ASSERT_GT(points.size(), 100U);
    for (const SheetPoint& p : points) {
      const Eigen::Vector3f local = turn.transpose() * (PointAt(p.i, p.j, p.k) - kCentre);
      EXPECT_LT(std::abs(local.z()), 0.9f);
      EXPECT_LT(local.head<2>().norm(), kRadius + 0.75f);
    }
  }
}

TEST(SheetPoints, LeaveNoWayThroughTheDiagonalOfAFace) {
  for (const double bend : {0.0, 11.0, 6.0}) {
    for (const Eigen::Vector3f& normal :
         {Eigen::Vector3f(0.2f, 0.35f, 1), Eigen::Vector3f(-0.78f, 0.29f, 0.56f),
          Eigen::Vector3f(0.4f, 0.5f, 0.1f)}) {
      const Grid grid = CubeGrid(kSide);
      const Layer layer(grid, {grid, SheetInGrid(0.3, bend, normal), 0.0f});
      EXPECT_EQ(NumCheckerboards(layer.inside()), 0) << bend << ' ' << normal.transpose();
    }
  }
}

TEST(SheetPoints, NeverLieAtTheEndsOfTheGrid) {
  GridSurface sheet = SheetInGrid(0.3, 0.0, {0.1f, 0.1f, 1});
  sheet.vertices.row(2).array() -= kCentre.z() - 0.6f;
  const std::vector<SheetPoint> points = FindSheetPoints(CubeGrid(kSide), sheet, 0);
  EXPECT_FALSE(points.empty());
  for (const SheetPoint& p : points) EXPECT_GE(p.k, 1);
}

}  // namespace
}  // namespace liquidblend::spacetime::sheet_points_test

#include "core/mesh/triangle_mesh.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <numbers>

#include "tests/synthetic/implicit.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend::mesh {
namespace {

constexpr double kFloatTolerance = 1e-5;  // of volumes around 1 from float positions

TEST(TriangleMesh, WithoutTrianglesIsClosedAndHasNoSize) {
  const TriangleMesh empty;
  EXPECT_TRUE(CheckClosed(empty).closed());
  EXPECT_TRUE(Validate(empty).ok());
  EXPECT_EQ(Volume(empty), 0.0);
  EXPECT_EQ(MeanEdgeLength(empty), 0.0);
  EXPECT_EQ(NumComponents(empty), 0);
}

TEST(CheckClosed, AcceptsTheBoundaryOfSolids) {
  for (const TriangleMesh& mesh :
       {synthetic::Icosphere({0, 0, 0}, 1, 2), synthetic::Box({0, 0, 0}, {1, 2, 3}, 2),
        synthetic::Torus({0, 0, 0}, 1, 0.3, 9, 5),
        synthetic::BallWithBubble({1, 2, 3}, 1, 0.5, 1)}) {
    const ClosednessReport report = CheckClosed(mesh);
    EXPECT_EQ(report.num_odd_edges, 0);
    EXPECT_EQ(report.num_misoriented_edges, 0);
    EXPECT_TRUE(CheckClosed(synthetic::Flipped(mesh)).closed());
  }
}

TEST(CheckClosed, CountsTheEdgesOfAHole) {
  TriangleMesh mesh = synthetic::Icosphere({0, 0, 0}, 1, 1);
  mesh.triangles.conservativeResize(3, mesh.num_triangles() - 1);
  EXPECT_EQ(CheckClosed(mesh).num_odd_edges, 3);
  EXPECT_EQ(CheckClosed(mesh).num_misoriented_edges, 3);  // a lone direction has no opposite
}

TEST(CheckClosed, CountsTheEdgesOfATurnedTriangle) {
  TriangleMesh mesh = synthetic::Icosphere({0, 0, 0}, 1, 1);
  mesh.triangles.col(4).reverseInPlace();
  EXPECT_EQ(CheckClosed(mesh).num_odd_edges, 0);
  EXPECT_EQ(CheckClosed(mesh).num_misoriented_edges, 3);
}

TEST(CheckClosed, TakesEdgesOfFourTrianglesIfTheyCancel) {
  // Two boxes that share an edge: not a manifold, but closed.
  TriangleMesh boxes = synthetic::Join(
      std::array{synthetic::Box({0, 0, 0}, {1, 1, 1}), synthetic::Box({1, 1, 0}, {2, 2, 1})});
  for (int& v : boxes.triangles.reshaped()) {
    for (int w = 0; w < v; ++w) {
      if (boxes.vertices.col(w) == boxes.vertices.col(v)) v = w;
    }
  }
  EXPECT_TRUE(CheckClosed(boxes).closed());
}

TEST(CheckClosed, IgnoresTrianglesThatBoundNothing) {
  TriangleMesh mesh = synthetic::Icosphere({0, 0, 0}, 1, 1);
  mesh.triangles.conservativeResize(3, mesh.num_triangles() + 1);
  mesh.triangles.rightCols(1) << 7, 7, 9;
  EXPECT_TRUE(CheckClosed(mesh).closed());
}

TEST(Validate, NamesTheFirstOffendingElement) {
  const TriangleMesh good = synthetic::Box({0, 0, 0}, {1, 1, 1});
  TriangleMesh mesh = good;
  mesh.vertices(1, 3) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(Validate(mesh).message(), "vertex 3: position y is nan, not a finite number");
  mesh = good;
  mesh.velocities.setZero(3, 8);
  EXPECT_TRUE(Validate(mesh).ok());
  mesh.velocities(2, 7) = -std::numeric_limits<float>::infinity();
  EXPECT_EQ(Validate(mesh).message(), "vertex 7: velocity z is -inf, not a finite number");
  mesh.velocities.setZero(3, 7);
  EXPECT_EQ(Validate(mesh).message(), "7 velocities for 8 vertices");
  mesh = good;
  mesh.normals.setZero(3, 9);
  EXPECT_EQ(Validate(mesh).message(), "9 normals for 8 vertices");
  mesh = good;
  mesh.triangles(2, 5) = 8;
  EXPECT_EQ(Validate(mesh).message(), "triangle 5: vertex 8 is not in [0, 8)");
  mesh.triangles(2, 5) = -1;
  EXPECT_EQ(Validate(mesh).message(), "triangle 5: vertex -1 is not in [0, 8)");
}

TEST(Volume, IsExactForBoxesWhereverTheyLie) {
  const TriangleMesh box = synthetic::Box({0, 0, 0}, {1, 2, 3}, 3);
  EXPECT_NEAR(Volume(box), 6.0, kFloatTolerance);
  EXPECT_NEAR(Volume(synthetic::Flipped(box)), -6.0, kFloatTolerance);
  EXPECT_NEAR(Volume(synthetic::Box({1000, 2000, 3000}, {1001, 2002, 3003})), 6.0, kFloatTolerance);
}

TEST(Volume, TakesBubblesOff) {
  const double ball = Volume(synthetic::Icosphere({0, 0, 0}, 1.0, 3));
  EXPECT_NEAR(ball, 4.0 / 3.0 * std::numbers::pi, 0.04);  // inscribed, so a little less
  EXPECT_LT(ball, 4.0 / 3.0 * std::numbers::pi);
  EXPECT_NEAR(Volume(synthetic::BallWithBubble({5, 0, 0}, 1.0, 0.5, 3)), 0.875 * ball,
              kFloatTolerance);
}

TEST(MeanEdgeLength, CountsEachSideOncePerTriangle) {
  // Of the 36 triangle sides of a cube 24 are edges and 12 diagonals.
  const TriangleMesh cube = synthetic::Box({0, 0, 0}, {2, 2, 2});
  EXPECT_NEAR(MeanEdgeLength(cube), 2 * (24 + 12 * std::numbers::sqrt2) / 36, kFloatTolerance);
}

TEST(NumComponents, CountsWhatTrianglesConnect) {
  TriangleMesh mesh = synthetic::BallWithBubble({0, 0, 0}, 1.0, 0.5, 1);
  EXPECT_EQ(NumComponents(mesh), 2);
  mesh.vertices.conservativeResize(3, mesh.num_vertices() + 1);  // a vertex without triangle
  EXPECT_EQ(NumComponents(mesh), 2);
}

TEST(Polygonize, IsClosedForAnyFunction) {
  const auto waves = [](const Eigen::Vector3d& p) {
    return std::sin(7 * p.x()) + std::sin(8 * p.y()) + std::cos(9 * p.z()) - 0.2;
  };
  const TriangleMesh mesh = synthetic::Polygonize(waves, {.spacing_m = 0.13});
  EXPECT_GT(mesh.num_triangles(), 1000);
  EXPECT_TRUE(CheckClosed(mesh).closed());
  EXPECT_TRUE(Validate(mesh).ok());
  EXPECT_GT(Volume(mesh), 0);
}

TEST(Polygonize, GivesTheVolumeOfABall) {
  const auto ball = [](const Eigen::Vector3d& p) { return p.norm() - 0.8; };
  const TriangleMesh mesh = synthetic::Polygonize(ball, {.spacing_m = 0.05});
  const double exact = 4.0 / 3.0 * std::numbers::pi * 0.8 * 0.8 * 0.8;
  EXPECT_NEAR(Volume(mesh), exact, 0.01 * exact);
  EXPECT_EQ(NumComponents(mesh), 1);
}

TEST(ComponentVolumes, AreOfEachPartAndAddUpToTheWhole) {
  const TriangleMesh parts[] = {synthetic::Icosphere({0, 0, 0}, 0.5, 4),
                                synthetic::BallWithBubble({3, 0, 0}, 1, 0.5, 4)};
  const TriangleMesh mesh = synthetic::Join(parts);
  const std::vector<double> volumes = ComponentVolumes(mesh);
  ASSERT_EQ(volumes.size(), 3U);
  EXPECT_NEAR(volumes[0], 4.18, 0.03);
  EXPECT_NEAR(volumes[1], 4.18 / 8, 0.005);
  EXPECT_NEAR(volumes[2], -4.18 / 8, 0.005);
  EXPECT_NEAR(volumes[0] + volumes[1] + volumes[2], Volume(mesh), 1e-6);
  EXPECT_TRUE(ComponentVolumes({}).empty());
}

}  // namespace
}  // namespace liquidblend::mesh

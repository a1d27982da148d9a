#include "worker/spacetime/field/triangle_tree.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/synthetic/shapes.h"
#include "tests/synthetic/surface_distance.h"

namespace liquidblend::spacetime {
namespace {

// Exact distances, from another program's tree.
void ExpectExact(const mesh::TriangleMesh& surface, float reach_m) {
  const TriangleTree tree(surface);
  const synthetic::SurfaceDistance truth(surface);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<float> anywhere(-reach_m, reach_m);
  for (int n = 0; n < 2000; ++n) {
    const Eigen::Vector3f point(anywhere(random), anywhere(random), anywhere(random));
    const float expected = truth.Distance(point);
    ASSERT_NEAR(tree.Distance(point), expected, 1e-5F * (1 + expected)) << point.transpose();
  }
}

TEST(TriangleTree, DistancesAreExactNearAndFar) {
  ExpectExact(synthetic::Torus({0.2F, 0, 0}, 1.0, 0.3, 40, 20), 1.5F);
  ExpectExact(synthetic::Torus({0.2F, 0, 0}, 1.0, 0.3, 40, 20), 50.0F);
  ExpectExact(synthetic::Box({-1, -1, -1}, {1, 1, 1}, 9),
              2.0F);  // many equal centres along an axis
  ExpectExact(synthetic::Icosphere({0, 0, 0}, 1.0, 0), 2.0F);
}

TEST(TriangleTree, VerticesLieOnTheSurface) {
  const mesh::TriangleMesh surface = synthetic::Icosphere({30, 0, 0}, 0.5, 3);
  const TriangleTree tree(surface);
  for (int64_t v = 0; v < surface.num_vertices(); ++v) {
    EXPECT_EQ(tree.Distance(surface.vertices.col(v)), 0.0F);
  }
}

TEST(TriangleTree, TrianglesWithoutAreaAreStillThere) {
  mesh::TriangleMesh surface;
  surface.vertices.resize(3, 3);
  surface.vertices << 0, 1, 2, 0, 0, 0, 0, 0, 0;  // on a line
  surface.triangles.resize(3, 20);
  for (int t = 0; t < 20; ++t) surface.triangles.col(t) = Eigen::Vector3i(0, 1, 2);
  EXPECT_FLOAT_EQ(TriangleTree(surface).Distance({0, 3, 0}), 3.0F);
}

TEST(TriangleTree, IsEmptyWithoutTriangles) {
  const mesh::TriangleMesh none;
  EXPECT_TRUE(TriangleTree(none).empty());
}

}  // namespace
}  // namespace liquidblend::spacetime

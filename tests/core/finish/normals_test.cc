#include "core/finish/normals.h"

#include <gtest/gtest.h>

#include "tests/synthetic/shapes.h"

namespace liquidblend::finish {
namespace {

TEST(AddNormals, OfASpherePointAwayFromItsCentre) {
  const Eigen::Vector3f centre(1, 2, 3);
  mesh::TriangleMesh sphere = synthetic::Icosphere(centre, 0.5, 3);
  AddNormals(sphere);
  ASSERT_EQ(sphere.normals.cols(), sphere.num_vertices());
  for (Eigen::Index v = 0; v < sphere.num_vertices(); ++v) {
    const Eigen::Vector3f outward = (sphere.vertices.col(v) - centre).normalized();
    EXPECT_NEAR(sphere.normals.col(v).norm(), 1.0F, 1e-5F);
    EXPECT_GT(sphere.normals.col(v).dot(outward), 0.9995F) << v;  // 1.8 degrees
  }
}

TEST(AddNormals, AreUnitVectorsEvenWithoutArea) {
  mesh::TriangleMesh surface;
  surface.vertices = Eigen::Matrix3Xf::Constant(3, 4, 2.0F);
  surface.triangles.resize(3, 2);
  surface.triangles << 0, 2, 1, 1, 2, 0;  // and vertex 3 has no triangle
  AddNormals(surface);
  for (int v = 0; v < 4; ++v) EXPECT_EQ(surface.normals.col(v), Eigen::Vector3f::UnitZ());
}

TEST(AddNormals, ASliverCountsLittle) {
  // A square roof whose corner carries a sliver that stands upright.
  mesh::TriangleMesh surface;
  surface.vertices.resize(3, 5);
  surface.vertices << 0, 1, 1, 0, 0.5F,  //
      0, 0, 1, 1, 0.0F,                  //
      0, 0, 0, 0, -0.001F;
  surface.triangles.resize(3, 3);
  surface.triangles << 0, 0, 0, 1, 2, 4, 2, 3, 1;
  AddNormals(surface);
  EXPECT_GT(surface.normals(2, 0), 0.9999F);
}

}  // namespace
}  // namespace liquidblend::finish

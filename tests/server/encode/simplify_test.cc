#include "server/encode/simplify.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/synthetic/shapes.h"

namespace liquidblend::encode::simplify_test {
namespace {

void ExpectSimplified(const mesh::TriangleMesh& surface, double share, double volume_tolerance) {
  ASSERT_TRUE(mesh::CheckClosed(surface).closed());
  const mesh::TriangleMesh simpler = Simplify(surface, share);
  ASSERT_TRUE(mesh::Validate(simpler).ok());
  EXPECT_TRUE(mesh::CheckClosed(simpler).closed());
  EXPECT_LE(static_cast<double>(simpler.num_triangles()),
            1.05 * share * static_cast<double>(surface.num_triangles()) + 8);
  EXPECT_GT(simpler.num_triangles(), 0);
  EXPECT_NEAR(mesh::Volume(simpler) / mesh::Volume(surface), 1.0, volume_tolerance);
  EXPECT_EQ(mesh::NumComponents(simpler), mesh::NumComponents(surface));
  EXPECT_EQ(simpler.velocities.cols(), surface.velocities.cols() > 0 ? simpler.vertices.cols() : 0);
}

TEST(Simplify, KeepsClosedSurfacesClosedAndTheirVolume) {
  ExpectSimplified(synthetic::Icosphere({1, 2, 3}, 0.5, 4), 0.5, 0.01);
  ExpectSimplified(synthetic::Icosphere({1, 2, 3}, 0.5, 4), 0.125, 0.05);
  ExpectSimplified(synthetic::Torus({0, 0, 0}, 1.0, 0.3, 64, 32), 0.25, 0.05);
  ExpectSimplified(synthetic::BallWithBubble({0, 0, 0}, 1.0, 0.4, 3), 0.5, 0.02);
  ExpectSimplified(synthetic::MovingSphere().frames[0], 0.25, 0.06);
}

TEST(Simplify, VelocitiesStayWithTheirVertices) {
  mesh::TriangleMesh sphere = synthetic::Icosphere({0, 0, 0}, 1.0, 3);
  sphere.velocities = 2 * sphere.vertices;
  const mesh::TriangleMesh simpler = Simplify(sphere, 0.3);
  EXPECT_EQ(simpler.velocities, 2 * simpler.vertices);
}

TEST(Simplify, OfNothingIsNothing) {
  EXPECT_EQ(Simplify(mesh::TriangleMesh(), 0.5).num_triangles(), 0);
}

}  // namespace
}  // namespace liquidblend::encode::simplify_test

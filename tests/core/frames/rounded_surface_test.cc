#include "core/frames/rounded_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/finish/normals.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend::frames {
namespace {

// A grid around the origin, 4 m wide.
RoundingOptions OptionsWith(int position_bits) {
  RoundingOptions options;
  options.grid.origin = {-2.0F, -2.0F, -2.0F};
  options.grid.extent_m = 4.0F;
  options.position_bits = position_bits;
  options.duration_s = 2.0;
  return options;
}

TEST(RoundSurface, KeepsTrianglesAndPutsVerticesOnTheGrid) {
  const mesh::TriangleMesh sphere = synthetic::Icosphere({0.1F, 0.2F, 0.3F}, 1.0, 3);
  for (const int bits : {kMinPositionBits, 14, kMaxRoundedBits}) {
    const RoundingOptions options = OptionsWith(bits);
    const RoundedSurface rounded = RoundSurface(sphere, options);
    ASSERT_EQ(rounded.positions.size(), static_cast<size_t>(sphere.num_vertices()));
    ASSERT_EQ(rounded.triangles.size(), static_cast<size_t>(sphere.num_triangles()));
    for (size_t i = 0; i < 3 * rounded.triangles.size(); ++i) {
      const auto t = static_cast<Eigen::Index>(i / 3), c = static_cast<Eigen::Index>(i % 3);
      const Eigen::Vector3f corner = sphere.vertices.col(sphere.triangles(c, t));
      const uint32_t v = rounded.triangles[i / 3][i % 3];
      for (int k = 0; k < 3; ++k) {
        const float x =
            rounded.origin_m[k] + rounded.step_m * static_cast<float>(rounded.positions[v][k]);
        EXPECT_NEAR(x, corner[k], StepOf(options.grid, bits) / 2 + 1e-6);
      }
    }
  }
}

TEST(RoundSurface, LeavesOutDegenerateTrianglesAndUnusedVertices) {
  mesh::TriangleMesh mesh;
  mesh.vertices = Eigen::Matrix3Xf::Random(3, 5);
  mesh.triangles.resize(3, 2);
  mesh.triangles.col(0) << 4, 2, 3;
  mesh.triangles.col(1) << 1, 1, 3;
  const RoundedSurface rounded = RoundSurface(mesh, OptionsWith(14));
  EXPECT_EQ(rounded.positions.size(), 3u);
  EXPECT_EQ(rounded.triangles, (std::vector<std::array<uint32_t, 3>>{{0, 1, 2}}));
}

TEST(RoundSurface, MovesWhatIsOutsideOntoTheGridsBorder) {
  const mesh::TriangleMesh sphere = synthetic::Icosphere({0, 0, 0}, 3.0, 2);
  const RoundedSurface rounded = RoundSurface(sphere, OptionsWith(10));
  uint16_t highest = 0;
  for (const auto& position : rounded.positions) {
    for (int k = 0; k < 3; ++k) highest = std::max(highest, position[k]);
  }
  EXPECT_EQ(highest, 1023);
}

// Floats are coarse there: the sum of origin and extent is rounded.
TEST(RoundSurface, FarFromZeroTheHighestCornerIsTheHighestNode) {
  RoundingOptions options = OptionsWith(kMaxRoundedBits);
  for (const float origin : {1000.3F, -5000.7F, 33333.3F}) {
    for (const float extent : {1.0F, 0.7F, 3.3F}) {
      options.grid.origin = {origin, origin, origin};
      options.grid.extent_m = extent;
      mesh::TriangleMesh mesh;
      mesh.vertices.resize(3, 3);
      mesh.vertices.col(0).setConstant(origin);
      mesh.vertices.col(1).setConstant(origin + extent);
      mesh.vertices.col(2).setConstant(origin + 2 * extent);
      mesh.triangles.resize(3, 1);
      mesh.triangles << 0, 1, 2;
      const RoundedSurface rounded = RoundSurface(mesh, options);
      EXPECT_EQ(rounded.positions[0][0], 0);
      EXPECT_GT(rounded.positions[1][0], 65000) << origin << " " << extent;
      EXPECT_GT(rounded.positions[2][0], 65000) << origin << " " << extent;
    }
  }
}

TEST(RoundSurface, RoundsAttributesWithinTheirSteps) {
  mesh::TriangleMesh sphere = synthetic::Icosphere({0, 0, 0}, 1.0, 3);
  finish::AddNormals(sphere);
  sphere.velocities = 3.0F * sphere.vertices;
  sphere.rest.resize(4, sphere.num_vertices());
  sphere.rest.topRows<3>() = sphere.vertices;
  sphere.rest.row(3).setConstant(1.5F);
  const RoundedSurface rounded = RoundSurface(sphere, OptionsWith(14));
  ASSERT_EQ(rounded.normals.size(), rounded.positions.size());
  ASSERT_EQ(rounded.velocities.size(), rounded.positions.size());
  ASSERT_EQ(rounded.rest.size(), rounded.positions.size());
  for (size_t v = 0; v < rounded.positions.size(); ++v) {
    for (int k = 0; k < 3; ++k) {
      const float x =
          rounded.origin_m[k] + rounded.step_m * static_cast<float>(rounded.positions[v][k]);
      EXPECT_NEAR(rounded.velocities[v][k] * rounded.velocity_step_m_s, 3 * x, 1e-3);
      EXPECT_NEAR(
          rounded.origin_m[k] + rounded.rest_step_m * static_cast<float>(rounded.rest[v][k]), x,
          rounded.step_m);
    }
    EXPECT_NEAR(rounded.rest[v][3] * rounded.rest_step_s, 1.5, 1e-4);
  }
}

}  // namespace
}  // namespace liquidblend::frames

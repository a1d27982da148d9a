#include "worker/spacetime/plan_layers.h"

#include <gtest/gtest.h>

#include "tests/synthetic/shapes.h"

namespace liquidblend::spacetime {
namespace {

mesh::Animation Sphere(double speed_m_per_frame) {
  synthetic::MovingSphereOptions options;
  options.num_frames = 3;
  options.velocity_m_per_s = {static_cast<float>(24 * speed_m_per_frame), 0, 0};
  return synthetic::MovingSphere(options);
}

TEST(PlanLayers, OneAFrameAndOneBeyondEachEnd) {
  const auto layers = PlanLayers(Sphere(0.1), 0.2);
  ASSERT_EQ(layers.size(), 5u);
  for (int l = 0; l < 5; ++l) EXPECT_EQ(layers[l].time, l - 1);
  EXPECT_EQ(layers[0].earlier, 0);
  EXPECT_EQ(layers[4].earlier, 2);
}

TEST(PlanLayers, MoreWhereTheSurfaceMovesFar) {
  const auto layers = PlanLayers(Sphere(0.5), 0.2);
  ASSERT_EQ(layers.size(), 9u);  // three steps a frame
  EXPECT_NEAR(layers[2].time, 1.0 / 3, 1e-9);
  EXPECT_EQ(layers[2].earlier, 0);
  EXPECT_EQ(layers[2].later, 1);
  EXPECT_NEAR(layers[2].share, 1.0 / 3, 1e-9);
  EXPECT_EQ(layers[4].earlier, layers[4].later);
}

// Sliding along itself does not change a surface's place.
TEST(PlanLayers, OnlyMotionAlongTheNormalCounts) {
  mesh::Animation still = Sphere(0.0);
  for (mesh::TriangleMesh& frame : still.frames) {
    for (int64_t v = 0; v < frame.num_vertices(); ++v) {
      const Eigen::Vector3f p = frame.vertices.col(v);
      frame.velocities.col(v) = 100 * Eigen::Vector3f(-p.y(), p.x(), 0);
    }
  }
  EXPECT_EQ(PlanLayers(still, 0.1).size(), 5u);
}

TEST(PlanLayers, NoneInBetweenWithoutVelocities) {
  mesh::Animation sphere = Sphere(0.5);
  for (mesh::TriangleMesh& frame : sphere.frames) frame.velocities.resize(3, 0);
  EXPECT_EQ(PlanLayers(sphere, 0.2).size(), 5u);
}

TEST(PlanLayers, FollowTheTimesOfTheFrames) {
  mesh::Animation sphere = Sphere(0.1);
  sphere.times = {0, 3, 3.5};
  const auto layers = PlanLayers(sphere, 0.2);
  ASSERT_EQ(layers.size(), 6u);  // 0.3 m over the gap: two steps
  EXPECT_EQ(layers[2].time, 1.5);
  EXPECT_EQ(layers[4].time, 3.5);
  EXPECT_EQ(layers[5].time, 4.5);
}

}  // namespace
}  // namespace liquidblend::spacetime

#include "worker/spacetime/nets/plan_layers.h"

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
  const auto layers = PlanLayers(Sphere(0.1), 0.2).layers;
  ASSERT_EQ(layers.size(), 5u);
  for (int l = 0; l < 5; ++l) EXPECT_EQ(layers[l].time, l - 1);
  EXPECT_EQ(layers[0].earlier, 0);
  EXPECT_EQ(layers[4].earlier, 2);
}

TEST(PlanLayers, MoreWhereTheSurfaceMovesFar) {
  const LayerPlan plan = PlanLayers(Sphere(0.5), 0.2);
  const auto& layers = plan.layers;
  ASSERT_EQ(layers.size(), 11u);  // three steps would do, hence four
  EXPECT_NEAR(layers[2].time, 0.25, 1e-9);
  EXPECT_EQ(layers[2].earlier, 0);
  EXPECT_EQ(layers[2].later, 1);
  EXPECT_NEAR(layers[2].share, 0.25, 1e-9);
  EXPECT_EQ(layers[5].earlier, layers[5].later);
  EXPECT_EQ(plan.first_layer, (std::vector<int>{0, 1, 5, 9, 10}));
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
  EXPECT_EQ(PlanLayers(still, 0.1).layers.size(), 5u);
}

TEST(PlanLayers, NoneInBetweenWithoutVelocities) {
  mesh::Animation sphere = Sphere(0.5);
  for (mesh::TriangleMesh& frame : sphere.frames) frame.velocities.resize(3, 0);
  EXPECT_EQ(PlanLayers(sphere, 0.2).layers.size(), 5u);
}

TEST(PlanLayers, FollowTheTimesOfTheFrames) {
  mesh::Animation sphere = Sphere(0.1);
  sphere.times = {0, 3, 3.5};
  const auto layers = PlanLayers(sphere, 0.2).layers;
  ASSERT_EQ(layers.size(), 6u);  // 0.3 m over the gap: two steps
  EXPECT_EQ(layers[2].time, 1.5);
  EXPECT_EQ(layers[4].time, 3.5);
  EXPECT_EQ(layers[5].time, 4.5);
}

template <typename Matrix>
Matrix Columns(const Matrix& first, const Matrix& then) {
  Matrix both(first.rows(), first.cols() + then.cols());
  both << first, then;
  return both;
}

// A drop that falls beside a still one.
TEST(PlanSteps, CutsWhatTheSurfaceSweepsAndNothingElse) {
  mesh::Animation drops = Sphere(0.5);
  const mesh::Animation still = Sphere(0.0);
  for (int k = 0; k < 3; ++k) {
    mesh::TriangleMesh &frame = drops.frames[k], other = still.frames[k];
    other.vertices.row(1).array() += 4.0f;
    other.triangles.array() += static_cast<int>(frame.num_vertices());
    frame.vertices = Columns(frame.vertices, other.vertices);
    frame.velocities = Columns(frame.velocities, other.velocities);
    frame.triangles = Columns(frame.triangles, other.triangles);
  }
  Grid grid;
  grid.spacing_m = 0.1;
  grid.origin_m = {-2, -2, -2};
  grid.dims = {60, 80, 40};
  const LayerPlan plan = PlanLayers(drops, 0.2);
  ASSERT_EQ(plan.num_steps(1), 4);
  const SlabSteps steps = PlanSteps(drops, plan, 1, grid, 0.2);
  const auto of = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3i voxel = ((p - grid.origin_m) / grid.spacing_m).cast<int>();
    return steps.OfVoxel(voxel[0], voxel[1], voxel[2]);
  };
  const double radius = synthetic::MovingSphereOptions().radius_m;
  EXPECT_EQ(of({radius + 0.25, 0, 0}), 4);     // before its front
  EXPECT_EQ(of({-radius + 0.25, 0, 0}), 4);    // where its back will be
  EXPECT_EQ(of({0.25, 0, radius + 0.35}), 1);  // its side slides
  EXPECT_EQ(of({radius, 4, 0}), 1);            // the other one
  EXPECT_EQ(PlanSteps(drops, plan, 0, grid, 0.2).num_steps(), 1);
}

}  // namespace
}  // namespace liquidblend::spacetime

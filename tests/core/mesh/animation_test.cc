#include "core/mesh/animation.h"

#include <gtest/gtest.h>

#include "core/mesh/animation_limits.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend::mesh {
namespace {

TEST(Animation, WithoutVerticesHasNoSize) {
  Animation animation;
  animation.frames.resize(2);
  EXPECT_EQ(MeanEdgeLength(animation), 0.0);
  EXPECT_TRUE(Bounds(animation).isZero());
}

TEST(MeanEdgeLength, WeighsFramesByTheirTriangles) {
  Animation animation;
  animation.frames = {synthetic::Box({0, 0, 0}, {1, 1, 1}), synthetic::Box({0, 0, 0}, {1, 1, 1}, 2),
                      TriangleMesh()};
  // 12 triangles with sides of length l, 48 with l / 2.
  const double whole = MeanEdgeLength(animation.frames[0]);
  EXPECT_NEAR(MeanEdgeLength(animation), whole * (12 + 48 * 0.5) / 60, 1e-6);
}

TEST(AddPreRoll, AddsFramesBeforeTheFirstOne) {
  for (const bool has_times : {false, true}) {
    Animation animation;
    animation.frames = {synthetic::Box({0, 0, 0}, {1, 1, 1}),
                        synthetic::Box({0, 0, 0}, {1, 1, 1}, 2)};
    if (has_times) animation.times = {0, 2.5};
    const double edge_length_m = MeanEdgeLength(animation);
    AddPreRoll(synthetic::Box({0, 0, 0}, {3, 3, 3}), 3, animation);
    ASSERT_EQ(animation.num_frames(), 5);
    EXPECT_EQ(animation.num_pre_roll, 3);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(animation.time(k), k - 3);
      EXPECT_EQ(animation.frames[k].vertices.maxCoeff(), 3);
    }
    EXPECT_EQ(animation.time(3), 0);
    EXPECT_EQ(animation.time(4), has_times ? 2.5 : 1);
    EXPECT_EQ(MeanEdgeLength(animation), edge_length_m);
    EXPECT_EQ(CheckTimes(animation), absl::OkStatus());
  }
}

TEST(Bounds, HoldAllFrames) {
  Animation animation;
  animation.frames = {TriangleMesh(), synthetic::Box({1, 2, 3}, {2, 3, 4}),
                      synthetic::Box({-1, 2.5f, 3}, {0, 5, 3.5f})};
  Eigen::Matrix<float, 3, 2> expected;
  expected << -1, 2, 2, 5, 3, 4;
  EXPECT_EQ(Bounds(animation), expected);
}

TEST(MovingSphere, MovesByItsVelocities) {
  const synthetic::MovingSphereOptions options = {
      .velocity_m_per_s = {1, -2, 0.5f}, .growth_m_per_s = 0.3, .num_frames = 5, .subdivisions = 2};
  const Animation animation = synthetic::MovingSphere(options);
  ASSERT_EQ(animation.num_frames(), 5);
  const auto frame_s = static_cast<float>(1 / animation.frames_per_second);
  for (int k = 0; k + 1 < animation.num_frames(); ++k) {
    const TriangleMesh& frame = animation.frames[k];
    EXPECT_TRUE(CheckClosed(frame).closed());
    EXPECT_LT((frame.vertices + frame_s * frame.velocities - animation.frames[k + 1].vertices)
                  .cwiseAbs()
                  .maxCoeff(),
              1e-6f);
  }
}

TEST(FallingDrop, MergesTwoComponentsIntoOne) {
  const Animation animation = synthetic::FallingDrop();
  EXPECT_EQ(NumComponents(animation.frames.front()), 2);
  EXPECT_EQ(NumComponents(animation.frames.back()), 1);
  for (const TriangleMesh& frame : animation.frames) {
    EXPECT_TRUE(CheckClosed(frame).closed());
    EXPECT_TRUE(Validate(frame).ok());
    EXPECT_GT(Volume(frame), 0);
  }
}

}  // namespace
}  // namespace liquidblend::mesh

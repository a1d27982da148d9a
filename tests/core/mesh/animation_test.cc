#include "core/mesh/animation.h"

#include <gtest/gtest.h>

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

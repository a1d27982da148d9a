#include "worker/registration/finish/extrapolation.h"

#include <gtest/gtest.h>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

TEST(Extrapolation, OfARigidMotionIsThatMotion) {
  const TestSurface source(SphereMesh());
  const Eigen::Vector4f motion(3, -2, 1, 0.5f);
  const Points displacement = motion.replicate(1, source.surface.points.cols());
  const Points result =
      Extrapolation(source.surface, source.neighbors, displacement, parallel::Arena(2));
  EXPECT_TRUE(result.isApprox(displacement, 1e-5f));
}

TEST(Extrapolation, KeepsTogetherWhatCameTogether) {
  const TestSurface source(SphereMesh());
  // Flattened to a sheet: top and bottom meet at weight 1 and would pass through each other.
  const Points& points = source.surface.points;
  Points displacement = Points::Zero(4, points.cols());
  const float middle = points.row(2).mean();
  displacement.row(2) = (middle - points.row(2).array()).matrix();
  const Points result =
      Extrapolation(source.surface, source.neighbors, displacement, parallel::Arena(2));
  const float before = displacement.row(2).cwiseAbs().maxCoeff();
  ASSERT_GT(before, 2.0f);
  EXPECT_LT(result.row(2).cwiseAbs().maxCoeff(), 0.35f * before);
}

// Of more points than are summed at a time.
TEST(Extrapolation, IsTheSameForAnyNumberOfThreads) {
  const TestSurface source(
      BuildMesh(synthetic::MovingSphere({.num_frames = 16, .subdivisions = 5})));
  ASSERT_GT(source.surface.points.cols(), 1 << 17);
  Random random(7);
  Points displacement(4, source.surface.points.cols());
  for (float& x : displacement.reshaped()) x = static_cast<float>(random.Below(2001) - 1000) / 500;
  const Points one =
      Extrapolation(source.surface, source.neighbors, displacement, parallel::Arena(1));
  EXPECT_EQ(one, Extrapolation(source.surface, source.neighbors, displacement, parallel::Arena(8)));
}

}  // namespace
}  // namespace liquidblend::registration

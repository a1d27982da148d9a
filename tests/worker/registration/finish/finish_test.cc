#include "worker/registration/finish/finish.h"

#include <gtest/gtest.h>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

// A sphere and the same one, 4 % larger: about a quarter of an edge outside.
class ProjectOntoTargetTest : public ::testing::Test {
 protected:
  static mesh::SpaceTimeMesh LargerSphere() {
    synthetic::MovingSphereOptions larger;
    larger.radius_m *= 1.04;
    return BuildMesh(synthetic::MovingSphere(larger));
  }
  // Returns the mean distance before.
  double Project(const ProjectionOptions& options, Points& displacement) const {
    return ProjectOntoTarget(source_.surface, source_.neighbors, target_, search_, options,
                             parallel::Arena(2), displacement);
  }
  double DistanceOf(Points displacement) const { return Project({}, displacement); }

  const TestSurface source_{SphereMesh()};
  const mesh::SpaceTimeMesh target_mesh_ = LargerSphere();
  const Surface target_{target_mesh_, source_.mesh.edge_length_m, parallel::Arena(2)};
  const ClosestPointSearch search_{target_mesh_, target_.points, target_.cells_around,
                                   parallel::Arena(2)};
};

TEST_F(ProjectOntoTargetTest, ClosesASmallGap) {
  Points displacement = Points::Zero(4, source_.surface.points.cols());
  const double before = Project({}, displacement);
  EXPECT_GT(before, 0.1);
  EXPECT_LT(DistanceOf(displacement), 0.4 * before);
}

TEST_F(ProjectOntoTargetTest, WhatIsNotLookedAtFollows) {
  const int64_t count = source_.surface.points.cols();
  Points displacement = Points::Zero(4, count);
  const double before = Project({.stride = 3}, displacement);
  EXPECT_LT(DistanceOf(displacement), 0.6 * before);
  for (int64_t v = 1; v < count; v += 3) {
    ASSERT_GT(displacement.col(v).norm(), 0) << v << " is not one that is looked at";
  }
}

TEST(Smooth, KeepsAConstantAndDampsNoise) {
  const TestSurface source(SphereMesh());
  const int64_t count = source.surface.points.cols();
  const Points constant = Eigen::Vector4f(1, 2, 3, 4).replicate(1, count);
  EXPECT_TRUE(Smooth(constant, source.neighbors, 10, parallel::Arena(2)).isApprox(constant, 1e-5f));
  Points noise(4, count);
  Random random(3);
  for (float& x : noise.reshaped()) x = static_cast<float>(random.Below(2001) - 1000) / 1000;
  EXPECT_LT(Smooth(noise, source.neighbors, 10, parallel::Arena(2)).norm(), 0.1f * noise.norm());
}

}  // namespace
}  // namespace liquidblend::registration

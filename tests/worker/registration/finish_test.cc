#include "worker/registration/finish.h"

#include <gtest/gtest.h>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

TEST(ProjectOntoTarget, ClosesASmallGap) {
  const TestSurface source(SphereMesh());
  // The same sphere, 4 % larger: about a quarter of an edge outside.
  synthetic::MovingSphereOptions larger;
  larger.radius_m *= 1.04;
  const TestSurface target(BuildMesh(synthetic::MovingSphere(larger)));
  const parallel::Arena arena(2);
  const Surface target_surface(target.mesh, source.mesh.edge_length_m);
  const ClosestPointSearch search(target.mesh, target_surface.points, target_surface.cells_around);
  Points displacement = Points::Zero(4, source.surface.points.cols());
  const double before = ProjectOntoTarget(source.surface, source.neighbors, target_surface, search,
                                          {}, arena, displacement);
  Points unchanged = displacement;
  const double after = ProjectOntoTarget(source.surface, source.neighbors, target_surface, search,
                                         {}, arena, unchanged);
  EXPECT_GT(before, 0.1);
  EXPECT_LT(after, 0.4 * before);
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

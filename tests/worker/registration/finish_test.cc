#include "worker/registration/finish.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/mesh/slice_at.h"
#include "tests/synthetic/inverted_share.h"
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
  const double before =
      ProjectOntoTarget(source.surface, source.neighbors, search, {}, arena, displacement);
  Points unchanged = displacement;
  const double after =
      ProjectOntoTarget(source.surface, source.neighbors, search, {}, arena, unchanged);
  EXPECT_GT(before, 0.1);
  EXPECT_LT(after, 0.4 * before);
}

// A sphere at rest that lies on itself.
struct OnItself : TestSurface {
  OnItself()
      : TestSurface(
            BuildMesh(synthetic::MovingSphere({.velocity_m_per_s = Eigen::Vector3f::Zero()}))),
        search(mesh, surface.points, surface.cells_around) {}
  int64_t Tuck(Points& displacement) const {
    return TuckTurnedLayers(surface, neighbors, search, parallel::Arena(2), displacement);
  }
  double InvertedShare(Points displacement) const {
    displacement.topRows<3>() *= static_cast<float>(mesh.edge_length_m);
    const std::vector<double> times = {0.6, 1.4, 2.3};
    synthetic::CrossingCount count;
    for (const auto& slice :
         mesh::SliceAt(mesh, mesh.vertices + displacement, times, parallel::Arena(2))) {
      count += synthetic::CountInverted(slice, 0.25 * mesh.edge_length_m);
    }
    return count.inverted_share();
  }
  ClosestPointSearch search;
};

TEST(TuckTurnedLayers, LeavesASingleLayerAsItIs) {
  const OnItself source;
  Points displacement = Points::Constant(4, source.surface.points.cols(), 0.05f);
  const Points before = displacement;
  EXPECT_EQ(source.Tuck(displacement), 0);
  EXPECT_EQ(displacement, before);
}

TEST(TuckTurnedLayers, HidesAFoldThatLiesOnTheTarget) {
  const OnItself source;
  Points displacement = Points::Zero(4, source.surface.points.cols());
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    const Eigen::Vector4f p = source.surface.points.col(v);
    const float radius = std::hypot(p[0], p[2]), angle = std::atan2(p[0], p[2]);
    // Turned about y, back and forth: three layers at the top, the middle one upside down.
    const float turned = angle - 2 * angle * std::exp(-9 * angle * angle);
    displacement(0, v) = radius * std::sin(turned) - p[0];
    displacement(2, v) = radius * std::cos(turned) - p[2];
  }
  const double before = source.InvertedShare(displacement);
  ASSERT_GT(before, 0.0);
  EXPECT_GT(source.Tuck(displacement), 0);
  EXPECT_LT(source.InvertedShare(displacement), 0.3 * before);
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

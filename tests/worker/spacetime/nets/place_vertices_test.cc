#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/worker/spacetime/field/grid_testing.h"
#include "worker/spacetime/nets/surface_nets.h"

namespace liquidblend::spacetime::place_vertices_test {
namespace {

constexpr int kSide = 32;
constexpr float kRadius = 8.0f;

Layer LayerOf(const mesh::TriangleMesh& mesh) {
  const Grid grid = CubeGrid(kSide);
  return Layer(grid, {grid, InGrid(mesh)});
}

Layer SphereLayer(const Eigen::Vector3f& centre) {
  return LayerOf(synthetic::Icosphere(centre, kRadius, 5));
}

// Of one step.
Slab PlaceBetween(const Layer& earlier, const Layer& later) {
  const std::array<const Layer*, 2> layers = {&earlier, &later};
  return PlaceVertices(CubeGrid(kSide), layers);
}

TEST(PlaceVertices, LieOnAStillSurface) {
  const Eigen::Vector3f centre(15.4f, 15.7f, 15.1f);
  const Layer layer = SphereLayer(centre);
  const Slab slab = PlaceBetween(layer, layer);
  ASSERT_GT(slab.num_vertices(), 800);
  double sum = 0;
  for (const auto& p : slab.vertices) {
    sum += std::abs((p.head<3>() - centre).norm() - kRadius);
    EXPECT_NEAR((p.head<3>() - centre).norm(), kRadius, 0.1f);
  }
  // On the outside of what is convex: the mean of the slice is on the surface.
  EXPECT_LT(sum / static_cast<double>(slab.num_vertices()), 0.04);
}

TEST(PlaceVertices, FollowAMovingSurfaceInTime) {
  const Eigen::Vector3f centre(14.4f, 15.7f, 15.1f), step(1.5f, 0, 0);
  const Slab slab = PlaceBetween(SphereLayer(centre), SphereLayer(centre + step));
  double sum = 0;
  for (const auto& p : slab.vertices) {
    const Eigen::Vector3f now = centre + p.w() * step;
    sum += std::abs((p.head<3>() - now).norm() - kRadius);
  }
  EXPECT_LT(sum / static_cast<double>(slab.num_vertices()), 0.06);
}

TEST(PlaceVertices, StayOffTheLayersAndInsideTheirCells) {
  const Slab slab = PlaceBetween(SphereLayer({15, 15, 15}), SphereLayer({16, 15.5f, 15}));
  ASSERT_EQ(slab.num_cells(), slab.num_vertices());
  for (int64_t v = 0; v < slab.num_vertices(); ++v) {
    EXPECT_GT(slab.vertices[v].w(), 0.0f);
    EXPECT_LT(slab.vertices[v].w(), 1.0f);
    EXPECT_GE(slab.vertices[v].x(), static_cast<float>(slab.cells[v].i));
    EXPECT_LE(slab.vertices[v].x(), static_cast<float>(slab.cells[v].i + 1));
  }
}

TEST(PlaceVertices, PutsAWallThatLiesInAGridPlaneThere) {
  const Layer layer = LayerOf(synthetic::Box({8, 8, 8}, {20.02f, 20.5f, 20.5f}, 8));
  const Slab slab = PlaceBetween(layer, layer);
  int on_wall = 0;
  for (const auto& p : slab.vertices) {
    if (p.y() < 10 || p.y() > 18 || p.z() < 10 || p.z() > 18 || p.x() < 15) continue;
    EXPECT_NEAR(p.x(), 20.02f, 1e-3f);
    ++on_wall;
  }
  EXPECT_GT(on_wall, 40);
}

TEST(PlaceVertices, CarryVelocities) {
  mesh::TriangleMesh sphere = synthetic::Icosphere({15, 15, 15}, kRadius, 4);
  sphere.velocities = Eigen::Matrix3Xf::Zero(3, sphere.num_vertices());
  sphere.velocities.row(1).setConstant(2.5f);
  const Layer layer = LayerOf(sphere);
  const Slab slab = PlaceBetween(layer, layer);
  ASSERT_EQ(static_cast<int64_t>(slab.velocities.size()), slab.num_vertices());
  for (const auto& u : slab.velocities) {
    EXPECT_TRUE(u.isApprox(Eigen::Vector3f(0, 2.5f, 0), 1e-5f));
  }
}

}  // namespace
}  // namespace liquidblend::spacetime::place_vertices_test

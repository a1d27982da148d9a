#include "worker/spacetime/fidelity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/synthetic/shapes.h"
#include "tests/synthetic/tracked.h"
#include "worker/spacetime/build.h"

namespace liquidblend::spacetime {
namespace {

mesh::SpaceTimeMesh BuildAs(const mesh::Animation& animation, Connectivity connectivity) {
  BuildOptions options;
  options.connectivity = connectivity;
  auto mesh = Build(animation, options, parallel::Arena(2));
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

mesh::Fidelity Measure(const mesh::Animation& animation, const mesh::SpaceTimeMesh& mesh,
                       const FidelityOptions& options = {}, int num_threads = 2) {
  return MeasureFidelity(animation, mesh, options, parallel::Arena(num_threads));
}

TEST(Fidelity, FramesOfATrackedAnimationAreShownExactly) {
  const mesh::Animation animation = synthetic::SphereToEllipsoid();
  const mesh::Fidelity fidelity = Measure(animation, BuildAs(animation, Connectivity::kTracked));
  EXPECT_EQ(fidelity.num_frames, animation.num_frames());
  EXPECT_LT(fidelity.max_distance_edges, 1e-5);
  EXPECT_LT(fidelity.max_volume_error, 1e-6);
  EXPECT_EQ(fidelity.num_components, animation.num_frames());
  EXPECT_EQ(fidelity.num_components_shown, animation.num_frames());
}

TEST(Fidelity, ARebuiltSphereIsShownClosely) {
  const mesh::Animation animation = synthetic::MovingSphere();
  const mesh::Fidelity fidelity = Measure(animation, BuildAs(animation, Connectivity::kRebuilt));
  EXPECT_GT(fidelity.mean_distance_edges, 0.0);
  EXPECT_LT(fidelity.mean_distance_edges, 0.03);  // the project's aim
  EXPECT_GE(fidelity.max_distance_edges, fidelity.mean_distance_edges);
  EXPECT_LT(fidelity.max_distance_edges, 0.2);
  EXPECT_LT(fidelity.max_volume_error, 0.002);
  EXPECT_EQ(fidelity.max_component_error, 0);
}

TEST(Fidelity, AShiftedMeshIsFound) {
  const mesh::Animation animation = synthetic::MovingSphere();
  mesh::SpaceTimeMesh mesh = BuildAs(animation, Connectivity::kTracked);
  const double edge_m = mesh.edge_length_m;
  mesh.vertices.row(1).array() += static_cast<float>(2 * edge_m);
  const mesh::Fidelity shifted = Measure(animation, mesh);
  // A sphere that is shifted by d is d |cos| away, in the mean d / 2.
  EXPECT_NEAR(shifted.mean_distance_edges, 1.0, 0.1);
  EXPECT_NEAR(shifted.max_distance_edges, 2.0, 0.1);
  EXPECT_LT(shifted.max_volume_error, 1e-5);
}

TEST(Fidelity, AShrunkMeshLacksVolume) {
  synthetic::MovingSphereOptions still;
  still.velocity_m_per_s = {0, 0, 0};
  const mesh::Animation animation = synthetic::MovingSphere(still);
  mesh::SpaceTimeMesh mesh = BuildAs(animation, Connectivity::kTracked);
  mesh.vertices.topRows<3>() *= 0.9F;
  const mesh::Fidelity shrunk = Measure(animation, mesh);
  EXPECT_NEAR(shrunk.max_volume_error, 1 - 0.9 * 0.9 * 0.9, 1e-4);
  EXPECT_NEAR(shrunk.mean_distance_edges * mesh.edge_length_m, 0.05, 0.003);
}

TEST(Fidelity, AComponentThatIsMissingIsFoundFromTheFramesSide) {
  mesh::Animation animation = synthetic::MovingSphere();
  const mesh::SpaceTimeMesh mesh = BuildAs(animation, Connectivity::kTracked);
  for (mesh::TriangleMesh& frame : animation.frames) {
    const mesh::TriangleMesh parts[] = {frame, synthetic::Icosphere({0, 3, 0}, 0.1, 1)};
    frame = synthetic::Join(parts);
  }
  const mesh::Fidelity fidelity = Measure(animation, mesh);
  EXPECT_EQ(fidelity.num_components, 2 * animation.num_frames());
  EXPECT_EQ(fidelity.num_components_shown, animation.num_frames());
  EXPECT_EQ(fidelity.max_component_error, 1);
  EXPECT_GT(fidelity.max_distance_edges * mesh.edge_length_m, 2.0);  // 3 m less the radii
}

TEST(Fidelity, FramesWithoutLiquidCountByTheirVolume) {
  mesh::Animation animation = synthetic::MovingSphere();
  const mesh::SpaceTimeMesh mesh = BuildAs(animation, Connectivity::kTracked);
  animation.frames[3] = mesh::TriangleMesh();
  const mesh::Fidelity fidelity = Measure(animation, mesh);
  EXPECT_EQ(fidelity.max_volume_error, 1.0);
  EXPECT_EQ(fidelity.max_component_error, 1);
  EXPECT_LT(fidelity.max_distance_edges, 1e-5);
}

TEST(Fidelity, MeasuresNoMoreFramesThanAskedForTheLastOneAmongThem) {
  mesh::Animation animation = synthetic::MovingSphere();
  const mesh::SpaceTimeMesh mesh = BuildAs(animation, Connectivity::kTracked);
  FidelityOptions options;
  options.max_frames = 3;
  options.max_points = 50;
  animation.frames.back().vertices.row(0).array() += 1.0F;
  const mesh::Fidelity fidelity = Measure(animation, mesh, options);
  EXPECT_EQ(fidelity.num_frames, 3);
  EXPECT_GT(fidelity.max_distance_edges * mesh.edge_length_m, 0.9);
}

TEST(Fidelity, IsTheSameForAnyNumberOfThreads) {
  const mesh::Animation animation = synthetic::MovingSphere();
  const mesh::SpaceTimeMesh mesh = BuildAs(animation, Connectivity::kRebuilt);
  const mesh::Fidelity one = Measure(animation, mesh, {}, 1);
  const mesh::Fidelity eight = Measure(animation, mesh, {}, 8);
  EXPECT_EQ(one.mean_distance_edges, eight.mean_distance_edges);
  EXPECT_EQ(one.max_distance_edges, eight.max_distance_edges);
  EXPECT_EQ(one.max_volume_error, eight.max_volume_error);
}

TEST(FidelityOptions, NamesTheFirstFieldOutOfRange) {
  FidelityOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.max_points = 0;
  EXPECT_EQ(std::string(options.Validate().message()), "max_points is 0, not in [1, 1e+06]");
}

}  // namespace
}  // namespace liquidblend::spacetime

#include "worker/spacetime/build.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "core/base/data_limit.h"
#include "core/mesh/animation_limits.h"
#include "core/slice/slice.h"
#include "tests/allocation_testing.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/slice_family.h"

namespace liquidblend::spacetime::build_test {
namespace {

using ::testing::HasSubstr;

BuildOptions Rebuilt() {
  BuildOptions options;
  options.connectivity = Connectivity::kRebuilt;
  return options;
}

mesh::SpaceTimeMesh BuildOrDie(const mesh::Animation& animation, int num_threads = 2,
                               const BuildOptions& options = Rebuilt()) {
  auto mesh = Build(animation, options, parallel::Arena(num_threads));
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

mesh::TriangleMesh Cut(const mesh::SpaceTimeMesh& mesh, double time_s) {
  const mesh::RegisteredFamily family = mesh::ViewOf(mesh);
  return synthetic::SliceFamily(slice::CellIndex(family), {}, time_s);
}

double SphereVolume(double radius) {
  return 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
}

TEST(Build, IsClosedAndOriented) {
  const auto mesh = BuildOrDie(synthetic::FallingDrop());
  const absl::Status valid = mesh::Validate(mesh);
  EXPECT_TRUE(valid.ok()) << valid;
  EXPECT_GT(mesh.num_first_vertices, 0);
  EXPECT_GT(mesh.num_last_vertices, 0);
}

TEST(Build, SlicesShowTheMovingSphere) {
  synthetic::MovingSphereOptions options;
  options.growth_m_per_s = 0.4;
  const auto mesh = BuildOrDie(synthetic::MovingSphere(options));
  for (const double time_s : {0.0, 0.01, 0.1, 0.25, 7.0 / 24}) {
    const mesh::TriangleMesh surface = Cut(mesh, time_s);
    EXPECT_TRUE(mesh::CheckClosed(surface).closed()) << time_s;
    EXPECT_EQ(mesh::NumComponents(surface), 1);
    const double radius = options.radius_m + options.growth_m_per_s * time_s;
    // A polyhedron of 1,280 triangles, some 12 spacings across.
    EXPECT_NEAR(mesh::Volume(surface) / SphereVolume(radius), 1.0, 0.04) << time_s;
    const Eigen::Vector3f centre =
        options.centre_m + static_cast<float>(time_s) * options.velocity_m_per_s;
    EXPECT_NEAR((surface.vertices.rowwise().mean() - centre).norm(), 0, 0.04) << time_s;
  }
}

TEST(Build, TellsTrackedAnimationsFromRebuiltOnes) {
  const auto tracked = BuildOrDie(synthetic::MovingSphere(), 2, {});
  EXPECT_TRUE(tracked.hexahedra.empty());
  EXPECT_FALSE(tracked.wedges.empty());
  const auto rebuilt = BuildOrDie(synthetic::FallingDrop(), 2, {});
  EXPECT_FALSE(rebuilt.hexahedra.empty());
  BuildOptions forced;
  forced.connectivity = Connectivity::kTracked;
  EXPECT_TRUE(BuildOrDie(synthetic::FallingDrop(), 2, forced).hexahedra.empty());
}

TEST(Build, WithLongerEdgesIsCoarser) {
  const mesh::Animation sphere = synthetic::MovingSphere();
  BuildOptions options;
  options.connectivity = Connectivity::kRebuilt;
  const parallel::Arena arena(2);
  const auto fine = Build(sphere, options, arena);
  options.edge_scale = 2;
  const auto coarse = Build(sphere, options, arena);
  ASSERT_TRUE(fine.ok() && coarse.ok()) << coarse.status();
  EXPECT_DOUBLE_EQ(coarse->edge_length_m, 2 * fine->edge_length_m);
  EXPECT_LT(coarse->num_vertices(), 0.4 * static_cast<double>(fine->num_vertices()));
  options.connectivity = Connectivity::kAuto;
  EXPECT_EQ(Build(sphere, options, arena).status().message(), "edge_scale is 2, not in [1, 1]");
}

TEST(Build, SlicesHaveTheVolumeOfTheFrames) {
  const mesh::Animation drop = synthetic::FallingDrop();
  const auto mesh = BuildOrDie(drop);
  for (int k = 0; k < drop.num_frames(); ++k) {
    const double volume = mesh::Volume(Cut(mesh, k / drop.frames_per_second));
    EXPECT_NEAR(volume / mesh::Volume(drop.frames[k]), 1.0, 0.002) << k;
  }
}

// As fast as drops get: three edges a frame, a dozen over their way.
TEST(Build, AFastDropHasTheVolumeOfTheFramesByItself) {
  synthetic::FallingDropsOptions options;
  options.drops = {{{0, 0, 2.9}, 0.25, 0}};
  options.velocity_m_per_s = -7.2;
  options.height_m = 3.5;
  options.num_frames = 9;
  const mesh::Animation drop = synthetic::FallingDrops(options);
  const auto mesh = BuildOrDie(drop);
  for (int k = 0; k < drop.num_frames(); ++k) {
    const std::vector<double> in_slice =
        mesh::ComponentVolumes(Cut(mesh, k / drop.frames_per_second));
    const std::vector<double> in_frame = mesh::ComponentVolumes(drop.frames[k]);
    ASSERT_EQ(in_frame.size(), 2u) << k;
    ASSERT_EQ(in_slice.size(), 2u) << k;
    EXPECT_NEAR(in_slice[0] / in_frame[0], 1.0, 0.002) << k;
    // Nothing tells how it moves before the first frame and after the last one.
    const bool is_end = k == 0 || k == drop.num_frames() - 1;
    EXPECT_NEAR(in_slice[1] / in_frame[1], 1.0, is_end ? 0.15 : 0.005) << k;
  }
}

// Two boxes whose edges nearly touch: in the grid's checkerboard faces they stay apart.
TEST(Build, PartsThatNearlyTouchStayApart) {
  mesh::Animation boxes;
  for (int k = 0; k < 4; ++k) {
    const float gap = 0.01f + 0.01f * static_cast<float>(k);
    const mesh::TriangleMesh parts[] = {synthetic::Box({-1, -1, 0}, {-gap, -gap, 1}, 12),
                                        synthetic::Box({gap, gap, 0}, {1, 1, 1}, 12)};
    boxes.frames.push_back(synthetic::Join(parts));
  }
  const auto mesh = BuildOrDie(boxes);
  for (int n = 0; n <= 12; ++n) {
    const mesh::TriangleMesh surface = Cut(mesh, 0.25 * n / 24);
    EXPECT_EQ(mesh::NumComponents(surface), 2) << n;
    EXPECT_EQ(mesh::CheckClosed(surface).num_non_manifold_edges, 0) << n;
  }
}

TEST(Build, KeepsSharpEdges) {
  mesh::Animation box;
  box.frames.assign(3, synthetic::Box({0.03f, 0.04f, 0.05f}, {1.03f, 1.04f, 1.05f}, 12));
  const mesh::TriangleMesh surface = Cut(BuildOrDie(box), 1 / 24.0);
  const Eigen::Vector3f corner(1.03f, 1.04f, 1.05f);
  EXPECT_LT((surface.vertices.colwise() - corner).colwise().norm().minCoeff(), 0.01f);
  EXPECT_NEAR(mesh::Volume(surface), 1.0, 0.002);
}

// Six grid spacings a frame, seven across.
TEST(Build, ABlobThatMovesFastStaysWhole) {
  synthetic::MovingSphereOptions options;
  options.radius_m = 0.25;
  options.velocity_m_per_s = {5, 0, 0};
  const mesh::Animation blob = synthetic::MovingSphere(options);
  const auto mesh = BuildOrDie(blob);
  ASSERT_GT(5.0 / 24, 5 * 0.9 * mesh.edge_length_m);
  const double volume = mesh::Volume(blob.frames[0]);
  for (int n = 0; n <= 20; ++n) {
    const mesh::TriangleMesh surface = Cut(mesh, (3 + n / 20.0) / 24);
    EXPECT_EQ(mesh::NumComponents(surface), 1) << n;
    EXPECT_NEAR(mesh::Volume(surface) / volume, 1.0, 0.03) << n;
  }
}

// The still pool beneath it costs what it costs alone.
TEST(Build, OnlyWhatMovesFastIsCutIntoSteps) {
  synthetic::MovingSphereOptions options;
  options.radius_m = 0.25;
  options.velocity_m_per_s = {5, 0, 0};
  mesh::Animation blob = synthetic::MovingSphere(options), pool = blob, both = blob;
  for (int k = 0; k < blob.num_frames(); ++k) {
    pool.frames[k] = synthetic::Box({-1, -1, -3}, {1, 1, -1}, 40);
    pool.frames[k].velocities.setZero(3, pool.frames[k].num_vertices());
    const mesh::TriangleMesh parts[] = {blob.frames[k], pool.frames[k]};
    both.frames[k] = synthetic::Join(parts);
  }
  const auto of_both = BuildOrDie(both), of_pool = BuildOrDie(pool);
  const double area = std::pow(of_pool.edge_length_m / of_both.edge_length_m, 2);
  const double num_expected = static_cast<double>(of_pool.num_vertices()) * area;
  EXPECT_GT(static_cast<double>(of_both.num_vertices()), num_expected);
  EXPECT_LT(static_cast<double>(of_both.num_vertices()), 1.25 * num_expected);
  const absl::Status valid = mesh::Validate(of_both);
  EXPECT_TRUE(valid.ok()) << valid;
  for (int n = 0; n <= 20; ++n) {
    EXPECT_EQ(mesh::NumComponents(Cut(of_both, (3 + n / 20.0) / 24)), 2) << n;
  }
}

// Three grid spacings across, four a frame; alone and over a pool.
TEST(Build, ASmallDropThatMovesFastIsCarriedWhole) {
  for (const bool with_pool : {false, true}) {
    mesh::Animation animation;
    constexpr float kEdge = 0.1f, kSpacing = 0.9f * kEdge;
    for (int k = 0; k < 6; ++k) {
      const float z = 1.5f - 4 * kSpacing * static_cast<float>(k);
      mesh::TriangleMesh drop = synthetic::Icosphere({0, 0, z}, 1.5 * kSpacing, 1);
      drop.velocities = Eigen::Vector3f(0, 0, -24 * 4 * kSpacing).replicate(1, drop.num_vertices());
      mesh::TriangleMesh pool = synthetic::Box({-1, -1, -3}, {1, 1, -2}, 14);
      pool.velocities = Eigen::Matrix3Xf::Zero(3, pool.num_vertices());
      const mesh::TriangleMesh parts[] = {pool, drop};
      animation.frames.push_back(with_pool ? synthetic::Join(parts) : drop);
    }
    const auto mesh = BuildOrDie(animation);
    EXPECT_TRUE(mesh::Validate(mesh).ok()) << mesh::Validate(mesh);
    const double volume = mesh::Volume(animation.frames[0]);
    for (int n = 0; n <= 20; ++n) {
      const mesh::TriangleMesh surface = Cut(mesh, (2 + n / 20.0) / 24);
      EXPECT_TRUE(mesh::CheckClosed(surface).closed()) << n;
      EXPECT_EQ(mesh::NumComponents(surface), with_pool ? 2 : 1) << n;
      EXPECT_NEAR(mesh::Volume(surface) / volume, 1.0, with_pool ? 0.002 : 0.01) << n;
      const float z = 1.5f - 4 * kSpacing * (2 + static_cast<float>(n) / 20);
      EXPECT_NEAR(surface.vertices.row(2).maxCoeff(), z + 1.5f * kSpacing, 0.02f * kEdge) << n;
    }
  }
}

// Shown by the pool, then on its own, then by the pool again: always once, but for a tenth of a
// frame.
TEST(Build, ADropThatLeavesAndJoinsIsShownOnce) {
  mesh::Animation animation;
  const mesh::TriangleMesh pool = synthetic::Box({-1, -1, -1}, {1, 1, 0}, 14);
  for (int k = 0; k < 7; ++k) {
    const float z = -0.05f + 0.25f * static_cast<float>(3 - std::abs(k - 3));
    const mesh::TriangleMesh drop = synthetic::Icosphere({0, 0, z}, 0.15, 2);
    const mesh::TriangleMesh parts[] = {pool, drop};
    const bool apart = z > 0.2f;
    animation.frames.push_back(apart ? synthetic::Join(parts) : pool);
  }
  const auto mesh = BuildOrDie(animation);
  EXPECT_TRUE(mesh::Validate(mesh).ok()) << mesh::Validate(mesh);
  EXPECT_FALSE(mesh.rigid_pieces.empty());
  for (int k = 0; k < 7; ++k) {
    EXPECT_EQ(mesh::NumComponents(Cut(mesh, k / 24.0)), mesh::NumComponents(animation.frames[k]))
        << k;
  }
}

TEST(Build, ShowsFramesAtTheirTimes) {
  synthetic::MovingSphereOptions options;
  options.num_frames = 4;
  mesh::Animation sphere = synthetic::MovingSphere(options);
  sphere.times = {0, 1, 3, 3.5};
  const auto mesh = BuildOrDie(sphere);
  EXPECT_EQ(mesh.num_frames, 4);  // up to frame 3
  for (int k = 0; k < 3; ++k) {
    const mesh::TriangleMesh surface = Cut(mesh, sphere.times[k] / 24);
    const Eigen::Vector3f centre = sphere.frames[k].vertices.rowwise().mean();
    EXPECT_NEAR((surface.vertices.rowwise().mean() - centre).norm(), 0, 0.01) << k;
  }
}

TEST(Build, MergesComponentsWhereTheAnimationDoes) {
  const mesh::Animation drop = synthetic::FallingDrop();
  const auto mesh = BuildOrDie(drop);
  const double end_s = (drop.num_frames() - 1) / drop.frames_per_second;
  EXPECT_EQ(mesh::NumComponents(Cut(mesh, 0)), 2);
  EXPECT_EQ(mesh::NumComponents(Cut(mesh, end_s)), 1);
  for (int n = 0; n <= 60; ++n) {
    EXPECT_TRUE(mesh::CheckClosed(Cut(mesh, end_s * n / 60)).closed()) << n;
  }
}

TEST(Build, KeepsABubble) {
  mesh::Animation animation;
  animation.frames.assign(4, synthetic::BallWithBubble({0, 0, 0}, 1.0, 0.5, 4));
  const mesh::TriangleMesh surface = Cut(BuildOrDie(animation), 1.5 / 24);
  EXPECT_EQ(mesh::NumComponents(surface), 2);
  EXPECT_NEAR(mesh::Volume(surface) / (SphereVolume(1.0) - SphereVolume(0.5)), 1.0, 0.03);
}

TEST(Build, KeepsLiquidThatAppearsAndDisappears) {
  mesh::Animation animation;
  animation.frames.assign(6, mesh::TriangleMesh{});
  for (int k = 2; k < 4; ++k) animation.frames[k] = synthetic::Icosphere({0, 0, 0}, 1.0, 3);
  const auto mesh = BuildOrDie(animation);
  EXPECT_EQ(Cut(mesh, 0).num_triangles(), 0);
  EXPECT_NEAR(mesh::Volume(Cut(mesh, 2.5 / 24)) / SphereVolume(1.0), 1.0, 0.05);
  EXPECT_EQ(Cut(mesh, 5.0 / 24).num_triangles(), 0);
}

TEST(Build, CarriesVelocitiesAndNormals) {
  const auto mesh = BuildOrDie(synthetic::MovingSphere());
  ASSERT_EQ(mesh.velocities.cols(), mesh.num_vertices());
  ASSERT_EQ(mesh.normals.cols(), mesh.num_vertices());
  for (int64_t v = 0; v < mesh.num_vertices(); ++v) {
    EXPECT_NEAR(mesh.velocities(0, v), 1.0f, 1e-4f);
    EXPECT_NEAR(mesh.normals.col(v).norm(), 1.0f, 1e-5f);
  }
}

TEST(Build, SameBytesAtAnyThreadCount) {
  const mesh::Animation drop = synthetic::FallingDrop();
  const auto one = BuildOrDie(drop, 1);
  for (const int num_threads : {2, 8}) {
    const auto many = BuildOrDie(drop, num_threads);
    ASSERT_EQ(many.num_vertices(), one.num_vertices());
    EXPECT_EQ(
        std::memcmp(many.vertices.data(), one.vertices.data(), sizeof(float) * one.vertices.size()),
        0);
    EXPECT_EQ(
        std::memcmp(many.normals.data(), one.normals.data(), sizeof(float) * one.normals.size()),
        0);
    EXPECT_EQ(many.hexahedra, one.hexahedra);
  }
}

// A grid has points between two bodies that are far apart, too.
mesh::Animation TwoSpheres(float distance_m) {
  mesh::Animation animation = synthetic::MovingSphere();
  for (mesh::TriangleMesh& frame : animation.frames) {
    const int64_t num_vertices = frame.num_vertices(), num_triangles = frame.num_triangles();
    const Eigen::Matrix3Xf far = frame.vertices.array() + distance_m;
    const Eigen::Matrix3Xi triangles = frame.triangles.array() + static_cast<int>(num_vertices);
    const Eigen::Matrix3Xf velocities = frame.velocities;
    frame.vertices.conservativeResize(3, 2 * num_vertices);
    frame.vertices.rightCols(num_vertices) = far;
    frame.triangles.conservativeResize(3, 2 * num_triangles);
    frame.triangles.rightCols(num_triangles) = triangles;
    frame.velocities.conservativeResize(3, 2 * velocities.cols());
    frame.velocities.rightCols(velocities.cols()) = velocities;
  }
  return animation;
}

TEST(Build, RefusesAGridThatMemoryCannotHold) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  const parallel::Arena arena(1);
  const base::ScopedDataLimit limit(128 << 20);
  EXPECT_TRUE(Build(TwoSpheres(10), Rebuilt(), arena).ok());
  const absl::Status status = Build(TwoSpheres(60), Rebuilt(), arena).status();
  EXPECT_TRUE(base::IsOverMemoryLimit(status)) << status;
  EXPECT_THAT(status.message(), HasSubstr("needs a grid of "));
  EXPECT_THAT(status.message(), HasSubstr("that the job may still allocate"));
}

TEST(Build, RefusesTimesBeyondTheLimits) {
  const parallel::Arena arena(1);
  mesh::Animation animation = synthetic::MovingSphere();
  for (int k = 0; k < animation.num_frames(); ++k) animation.times.push_back(k);
  animation.times.back() = 1e9;
  for (const Connectivity connectivity : {Connectivity::kRebuilt, Connectivity::kTracked}) {
    BuildOptions options;
    options.connectivity = connectivity;
    const absl::Status status = Build(animation, options, arena).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(status.message(), HasSubstr("its time is 1e+09 frames, not in [0, 100000]"));
  }
}

TEST(Build, BridgesTheLongestGap) {
  mesh::Animation animation = synthetic::MovingSphere();
  animation.frames.resize(3);
  animation.times = {0, 1, 1 + mesh::kLongestGap};
  for (const Connectivity connectivity : {Connectivity::kRebuilt, Connectivity::kTracked}) {
    BuildOptions options;
    options.connectivity = connectivity;
    for (mesh::TriangleMesh& frame : animation.frames) frame.velocities.resize(3, 0);
    const auto mesh = Build(animation, options, parallel::Arena(1));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_TRUE(mesh::Validate(*mesh).ok());
    EXPECT_TRUE(mesh::CheckClosed(Cut(*mesh, 125 / animation.frames_per_second)).closed());
  }
}

TEST(Build, RefusesWhatItCannotBuildAndSaysWhy) {
  const parallel::Arena arena(1);
  mesh::Animation single = synthetic::MovingSphere();
  single.frames.resize(1);
  EXPECT_THAT(Build(single, {}, arena).status().message(), HasSubstr("1 frames"));
  mesh::Animation empty = synthetic::MovingSphere();
  for (auto& frame : empty.frames) frame = {};
  EXPECT_EQ(Build(empty, {}, arena).status().code(), absl::StatusCode::kInvalidArgument);
  BuildOptions options;
  options.spacing_edges = 9;
  EXPECT_THAT(Build(synthetic::MovingSphere(), options, arena).status().message(),
              HasSubstr("spacing_edges is 9"));
  options = Rebuilt();
  options.droplet_vertices = 0;
  mesh::Animation far = synthetic::MovingSphere();
  far.frames[0].vertices.col(0) = Eigen::Vector3f(1e6f, 1e6f, 1e6f);
  EXPECT_EQ(Build(far, options, arena).status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace liquidblend::spacetime::build_test

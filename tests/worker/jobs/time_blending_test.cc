// Two spheres that fall from rest, from different heights, and the one that the server makes
// half-way between them.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/blend/blend.h"
#include "core/finish/velocities.h"
#include "core/mesh/registered_family.h"
#include "core/slice/slice.h"
#include "tests/synthetic/families.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/slice_family.h"
#include "worker/jobs/assemble_family.h"
#include "worker/jobs/previous_version.h"
#include "worker/spacetime/build.h"

namespace liquidblend::jobs {
namespace {

constexpr double kFps = 24.0;
constexpr float kGravity = 9.81F / (24.0F * 24.0F);  // metres per frame squared
constexpr int kNumFrames = 25;
// The source falls from 9 m, the target from 16 m and so takes 4/3 of the time to each place on the
// way that is the same share of the whole.
constexpr float kLow_m = 9, kHigh_m = 16, kSlower = 4.0F / 3.0F;

// x, y, z of the source's sphere of 1 m follow the fall.
mesh::SpaceTimeMesh FallingSphere(int subdivisions) {
  mesh::SpaceTimeMesh mesh = synthetic::WedgeSphere(subdivisions, {.num_frames = kNumFrames});
  mesh.velocities = Eigen::Matrix3Xf::Zero(3, mesh.num_vertices());
  for (int64_t v = 0; v < mesh.num_vertices(); ++v) {
    const float t = mesh.vertices(3, v);
    mesh.vertices(2, v) += kLow_m - kGravity * t * t / 2;
    mesh.velocities(2, v) = -kGravity * t * static_cast<float>(kFps);
  }
  return mesh;
}

registration::Registration ToHighFall(const mesh::SpaceTimeMesh& mesh) {
  registration::Registration result;
  result.displacement.setZero(4, mesh.num_vertices());
  for (int64_t v = 0; v < mesh.num_vertices(); ++v) {
    const float t = mesh.vertices(3, v);
    // 16 - g (4/3 t)^2 / 2 is 16/9 of 9 - g t^2 / 2.
    result.displacement(2, v) = (kHigh_m / kLow_m - 1) * (kLow_m - kGravity * t * t / 2);
    result.displacement(3, v) = (kSlower - 1) * t;
  }
  return result;
}

mesh::RegisteredFamily Family(const std::optional<double>& rest_time_s) {
  FamilyContents contents;
  contents.name = "falls";
  contents.source_name = "low";
  contents.time_blending.rest_time_s = rest_time_s;
  contents.source = FallingSphere(3);
  contents.targets.resize(1);
  contents.targets[0].name = "high";
  contents.targets[0].registration = ToHighFall(contents.source);
  FamilyLevel& level = contents.coarser_levels.emplace_back();
  level.mesh = FallingSphere(2);
  level.targets.push_back(ToHighFall(level.mesh));
  contents.bounds =
      Eigen::AlignedBox3f(Eigen::Vector3f(-2, -2, -2), Eigen::Vector3f(2, 2, kHigh_m + 2));
  auto family = AssembleFamily(std::move(contents));
  EXPECT_TRUE(family.ok()) << family.status();
  return *std::move(family);
}

struct Seen {
  double height_m = 0;
  double speed_m_s = 0;  // downward
};

Seen Look(const mesh::RegisteredFamily& family, double weight, double frame) {
  const slice::CellIndex index(family);
  const std::vector<double> weights = {weight};
  slice::Workspace workspace;
  EXPECT_TRUE(slice::FindCandidates(index, weights, frame / kFps, workspace).ok());
  const blend::Blender blender(family, weights);
  mesh::TriangleMesh surface = slice::March(index, blender, workspace);
  const auto count = static_cast<size_t>(surface.num_vertices());
  EXPECT_GT(count, 0U);
  const auto near = std::span(workspace.near_vertex).first(count);
  const auto far = std::span(workspace.far_vertex).first(count);
  std::vector<mesh::Float4> near_positions(count), far_positions(count);
  blender.Place(near, near_positions.data());
  blender.Place(far, far_positions.data());
  finish::AddVelocities(family, {near, far, near_positions, far_positions, workspace.time_ticks},
                        surface);
  return {0.5 * (surface.vertices.row(2).minCoeff() + surface.vertices.row(2).maxCoeff()),
          -surface.velocities.row(2).mean()};
}

TEST(TimeBlending, InSquaresADropFromAnyHeightFallsAsItWould) {
  const mesh::RegisteredFamily family = Family(0.0);
  for (const double weight : {0.0, 0.25, 0.5, 1.0}) {
    const double height_m = (1 - weight) * kLow_m + weight * kHigh_m;
    for (const mesh::RegisteredFamily* level :
         {&std::as_const(family), family.coarser_levels.data()}) {
      for (const double frame : {1.0, 6.0, 13.5, 20.0}) {
        const Seen seen = Look(*level, weight, frame);
        EXPECT_NEAR(seen.height_m, height_m - kGravity * frame * frame / 2, 5e-3) << frame;
        EXPECT_NEAR(seen.speed_m_s, kGravity * frame * kFps, 0.15) << frame;
      }
    }
  }
}

// So the test above shows something.
TEST(TimeBlending, LinearlyItFallsTooFast) {
  const mesh::RegisteredFamily family = Family(std::nullopt);
  const double frame = 20.0;
  const double right = 0.5 * (kLow_m + kHigh_m) - kGravity * frame * frame / 2;
  EXPECT_LT(Look(family, 0.5, frame).height_m, right - 0.05);
  EXPECT_NEAR(Look(family, 0.0, frame).height_m, kLow_m - kGravity * frame * frame / 2, 5e-3);
}

// Nowhere along an edge between two layers, as rebuilt meshes are cut at whole frames, either.
TEST(TimeBlending, WeightZeroIsTheSourceHoweverTimesBlend) {
  const mesh::RegisteredFamily linear = Family(std::nullopt), squares = Family(0.0);
  for (const double frame : {0.0, 0.25, 0.5, 1.0, 1.7, 12.5, 24.0}) {
    const Seen expected = Look(linear, 0, frame), seen = Look(squares, 0, frame);
    EXPECT_NEAR(seen.height_m, expected.height_m, 1e-5) << frame;
    EXPECT_NEAR(seen.speed_m_s, expected.speed_m_s, 1e-3) << frame;
  }
}

TEST(TimeBlending, ARebuiltBallIsWhereItWasInEachFrame) {
  const parallel::Arena arena(1);
  constexpr double kSpeed = 3.6;  // m/s: about 1.5 edges a frame
  synthetic::MovingSphereOptions options;
  options.velocity_m_per_s = {static_cast<float>(kSpeed), 0, 0};
  options.num_frames = 5;
  spacetime::BuildOptions build;
  build.connectivity = spacetime::Connectivity::kRebuilt;
  auto mesh = spacetime::Build(synthetic::MovingSphere(options), build, arena);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  FamilyContents contents;
  contents.source = *std::move(mesh);
  contents.time_blending.rest_time_s = 0.0;
  contents.bounds = Eigen::AlignedBox3f(Eigen::Vector3f(-2, -2, -2), Eigen::Vector3f(2, 2, 2));
  const auto family = AssembleFamily(std::move(contents));
  ASSERT_TRUE(family.ok()) << family.status();
  const slice::CellIndex index(*family);
  for (int k = 0; k < 5; ++k) {
    const mesh::TriangleMesh surface =
        synthetic::SliceFamily(index, {}, k / family->frames_per_second);
    const float centre =
        0.5F * (surface.vertices.row(0).minCoeff() + surface.vertices.row(0).maxCoeff());
    EXPECT_NEAR(centre, kSpeed * k / kFps, 5e-3) << k;
  }
}

RegisteredTarget FromRest(const std::string& name, double time_frames) {
  RegisteredTarget target;
  target.name = name;
  target.registration.report.rest = {true, time_frames, "they fall"};
  return target;
}

TEST(TimeBlending, ChosenFromRestIsInSquares) {
  const TimeBlending one = ChooseTimeBlending({FromRest("high", 0)}, kFps);
  EXPECT_EQ(one.rest_time_s, 0.0);
  EXPECT_EQ(one.reason, "high: they fall");
  const TimeBlending two = ChooseTimeBlending({FromRest("a", -12), FromRest("b", -12.5)}, kFps);
  ASSERT_TRUE(two.rest_time_s.has_value());
  EXPECT_NEAR(*two.rest_time_s, -12.25 / kFps, 1e-12);
  EXPECT_EQ(ChooseTimeBlending({FromRest("a", -1e9)}, kFps).rest_time_s, -3600);
}

TEST(TimeBlending, ChosenIsLinearUnlessAllTargetsFallFromRestSinceTheSameTime) {
  RegisteredTarget thrown = FromRest("thrown", 0);
  thrown.registration.report.rest = {false, 0, "it rises"};
  const TimeBlending blending = ChooseTimeBlending({FromRest("high", 0), thrown}, kFps);
  EXPECT_FALSE(blending.rest_time_s.has_value());
  EXPECT_EQ(blending.reason, "thrown: it rises");
  const TimeBlending apart = ChooseTimeBlending({FromRest("a", 0), FromRest("b", -2)}, kFps);
  EXPECT_FALSE(apart.rest_time_s.has_value());
  EXPECT_EQ(apart.reason, "liquid was at rest at different times in the targets, 2.0 frames apart");
  RegisteredTarget old;
  old.name = "old";
  EXPECT_EQ(ChooseTimeBlending({old}, kFps).reason, "old: an older program registered it");
}

// What a refinement starts from, and the targets that it keeps.
TEST(TimeBlending, InFramesAgainAllIsAsItWas) {
  mesh::SpaceTimeMesh mesh = FallingSphere(2);
  registration::Registration target = ToHighFall(mesh);
  target.extrapolation = 0.5F * target.displacement;
  const Eigen::Matrix4Xf vertices = mesh.vertices;
  const registration::Registration before = target;
  FamilyContents contents;
  contents.time_blending.rest_time_s = -0.25;
  contents.source = std::move(mesh);
  contents.targets.resize(2);
  for (RegisteredTarget& each : contents.targets) each.registration = target;
  contents.bounds = Eigen::AlignedBox3f(Eigen::Vector3f(-2, -2, -2), Eigen::Vector3f(2, 2, 99));
  const auto family = AssembleFamily(std::move(contents));
  ASSERT_TRUE(family.ok()) << family.status();
  ASSERT_GT((MatrixOf(family->vertices) - vertices).cwiseAbs().maxCoeff(), 1.0F);
  const mesh::RegisteredFamily again = InFrames(*family);
  EXPECT_FALSE(again.rest_time_s.has_value());
  EXPECT_LT((MatrixOf(again.vertices) - vertices).cwiseAbs().maxCoeff(), 1e-5F);
  ASSERT_EQ(again.targets.size(), 2U);
  for (const mesh::FamilyTarget& each : again.targets) {
    const auto error = [](std::span<const mesh::Float4> a, const Eigen::Matrix4Xf& b) {
      return (MatrixOf(a) - b).cwiseAbs().maxCoeff();
    };
    EXPECT_LT(error(each.displacement, before.displacement), 2e-5F);
    EXPECT_LT(error(each.extrapolation, before.extrapolation), 2e-5F);
  }
}

}  // namespace
}  // namespace liquidblend::jobs

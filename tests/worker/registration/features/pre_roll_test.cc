#include "worker/registration/features/pre_roll.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/mesh/components.h"
#include "core/mesh/slice_at.h"
#include "core/mesh/time_axis.h"
#include "tests/synthetic/surface_distance.h"
#include "tests/worker/registration/drops_testing.h"
#include "worker/registration/features/automatic.h"
#include "worker/registration/features/starts.h"
#include "worker/registration/register.h"

namespace liquidblend::registration::pre_roll_test {
namespace {

constexpr double kSmallestPart = 3.0;  // edges; the drops have a diameter of four
constexpr double kLow = 0.4, kHigh = 0.8;

mesh::Animation Drops(const std::vector<synthetic::SteadyDrop>& drops) {
  synthetic::FallingDropsOptions options;
  options.drops = drops;
  options.pool_half_width_m = {1.2, 0.5};
  options.height_m = 1.5;
  options.num_frames = 20;
  return synthetic::FallingDrops(options);
}

std::optional<PreRoll> Find(const mesh::Animation& source,
                            const std::vector<mesh::Animation>& targets) {
  std::vector<mesh::TriangleMesh> first;
  for (const mesh::Animation& target : targets) first.push_back(target.frames[0]);
  return FindPreRoll(source.frames[0], first, mesh::Up::kZ, {kSmallestPart, 0});
}

// The source's mesh with the pre-roll.
mesh::SpaceTimeMesh Build(mesh::Animation source, const PreRoll& pre_roll) {
  mesh::AddPreRoll(pre_roll.surface, kPreRollFrames, source);
  mesh::SpaceTimeMesh mesh = BuildMesh(source);
  LowerParts(pre_roll, parallel::Arena(2), mesh);
  return mesh;
}

Registration Registered(const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target,
                        int num_threads = 2, const std::vector<Correspondence>& users = {},
                        bool automatic = true) {
  RegistrationOptions options;
  options.automatic_correspondences = automatic;
  options.sample_share = 0.2;  // the meshes are small
  options.max_iterations = 10;
  options.smallest_part_edges = kSmallestPart;
  auto result = Register(source, target, users, options, parallel::Arena(num_threads));
  EXPECT_TRUE(result.ok()) << result.status();
  return *std::move(result);
}

mesh::TriangleMesh SliceBlend(const mesh::SpaceTimeMesh& source, const Registration& registration,
                              float weight, double frame) {
  const double times[] = {frame};
  // Times of the pre-roll are compressed, as in families.
  const mesh::TimeAxis axis({}, source.frames_per_second, source.num_frames, source.num_pre_roll);
  Eigen::Matrix4Xf vertices = source.vertices, displacement = registration.displacement;
  axis.ToTicks(vertices, displacement);
  axis.ToTicks(vertices);
  Eigen::Matrix4Xf blend = vertices + weight * displacement;
  auto first = blend.row(3).leftCols(source.num_first_vertices);
  first = first.cwiseMin(-1e-3F);
  return mesh::SliceAt(source, blend, times, parallel::Arena(2))[0];
}

// What is neither the pool nor crumbs.
std::vector<mesh::Component> DropsOf(const mesh::TriangleMesh& surface) {
  std::vector<mesh::Component> drops;
  for (const mesh::Component& component : mesh::FindComponents(surface)) {
    if (component.volume > 0.01 && component.volume < 0.1) drops.push_back(component);
  }
  return drops;
}

TEST(PreRoll, CutsOffTheDropThatIsApartInTheTarget) {
  const mesh::Animation source = Drops({BridgedDropAt(0.1, kLow)});
  const mesh::Animation target = Drops({DropAt(0, kHigh)});
  const auto pre_roll = Find(source, {target});
  ASSERT_TRUE(pre_roll);
  EXPECT_TRUE(mesh::CheckClosed(pre_roll->surface).closed());
  EXPECT_EQ(mesh::Validate(pre_roll->surface), absl::OkStatus());
  EXPECT_EQ(pre_roll->surface.velocities.cols(), pre_roll->surface.num_vertices());
  EXPECT_EQ(mesh::NumComponents(pre_roll->surface), 2);
  const auto drops = DropsOf(pre_roll->surface);
  ASSERT_EQ(drops.size(), 1u);
  EXPECT_NEAR(drops[0].volume, DropsOf(target.frames[0])[0].volume, 1e-4);
  ASSERT_EQ(pre_roll->parts.size(), 1u);
  const double edge_m = mesh::MeanEdgeLength(source.frames[0]);
  const Eigen::Vector3d place = drops[0].centre - pre_roll->parts[0].rise_m;
  EXPECT_LT((place - Eigen::Vector3d(0.1, 0, kLow)).norm(), edge_m);
  EXPECT_GT(pre_roll->parts[0].rise_m[2], edge_m);
  // Without the drop and its bridge the pool is left.
  const double pool_m3 = mesh::Volume(pre_roll->surface) - drops[0].volume;
  EXPECT_NEAR(pool_m3, mesh::Volume(target.frames[0]) - drops[0].volume, 0.02);
}

TEST(PreRoll, IsNotThereWhereTheStartsAreAlike) {
  const mesh::Animation bridged = Drops({BridgedDropAt(0, kLow)}), free = Drops({DropAt(0, kHigh)});
  const mesh::Animation pool = Drops({});
  EXPECT_FALSE(Find(free, {free}));
  EXPECT_FALSE(Find(bridged, {bridged}));
  EXPECT_FALSE(Find(free, {bridged}));
  EXPECT_FALSE(Find(pool, {free}));
  EXPECT_FALSE(Find(bridged, {}));
  mesh::Animation empty = free;
  empty.frames[0] = {};
  EXPECT_FALSE(Find(empty, {free}));
  EXPECT_FALSE(Find(bridged, {empty}));
}

TEST(PreRoll, IsNotThereWhereTheRaisedPartHasNoRoom) {
  const mesh::Animation target = Drops({DropAt(0, kHigh)});
  EXPECT_TRUE(Find(Drops({BridgedDropAt(0, kLow), DropAt(0.8, 1.0)}), {target}));
  EXPECT_FALSE(Find(Drops({BridgedDropAt(0, kLow), DropAt(0.3, 0.97)}), {target}));
}

TEST(PreRoll, CutsOffOnceWhatSeveralTargetsHave) {
  const mesh::Animation source = Drops({BridgedDropAt(-0.6, kLow), BridgedDropAt(0.6, kLow)});
  const mesh::Animation left = Drops({DropAt(-0.6, kHigh), BridgedDropAt(0.6, kLow)});
  const mesh::Animation both = Drops({DropAt(-0.6, kHigh), DropAt(0.6, kHigh)});
  EXPECT_EQ(DropsOf(Find(source, {left, left})->surface).size(), 1u);
  EXPECT_EQ(DropsOf(Find(source, {left, both})->surface).size(), 2u);
}

TEST(PreRoll, LowersThePartsAgainAndNothingElse) {
  const mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const auto pre_roll = Find(source, {Drops({DropAt(0, kHigh)})});
  ASSERT_TRUE(pre_roll);
  mesh::Animation with = source;
  mesh::AddPreRoll(pre_roll->surface, kPreRollFrames, with);
  const mesh::SpaceTimeMesh raised = BuildMesh(with);
  mesh::SpaceTimeMesh lowered = raised;
  LowerParts(*pre_roll, parallel::Arena(2), lowered);
  const float rise_m = static_cast<float>(pre_roll->parts[0].rise_m[2]);
  const float bottom_m = pre_roll->parts[0].surface.vertices.row(2).minCoeff();
  for (int64_t v = 0; v < raised.num_vertices(); ++v) {
    const Eigen::Vector4f before = raised.vertices.col(v), after = lowered.vertices.col(v);
    const float fall_m = before[2] - after[2];
    if (before[3] >= 0) {
      EXPECT_EQ(before, after);
    }
    if (before[3] > -1) continue;
    const bool is_of_drop = before[2] > bottom_m - 0.05F;
    EXPECT_NEAR(fall_m, is_of_drop ? rise_m : 0, 1e-5) << before.transpose();
  }
}

TEST(PreRoll, LeavesTheFramesOfTheSourceAsTheyAre) {
  const mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const auto pre_roll = Find(source, {Drops({DropAt(0, kHigh)})});
  ASSERT_TRUE(pre_roll);
  const mesh::SpaceTimeMesh mesh = Build(source, *pre_roll);
  EXPECT_EQ(mesh.num_frames, source.num_frames());
  EXPECT_EQ(mesh.num_pre_roll, kPreRollFrames);
  EXPECT_EQ(mesh::Validate(mesh), absl::OkStatus());
  const mesh::SpaceTimeMesh plain = BuildMesh(source);
  for (const double frame : {0.0, 1.0, 5.0, 19.0}) {
    const double times[] = {frame};
    const auto distance = [&](const mesh::SpaceTimeMesh& of) {
      return synthetic::MeanSymmetricDistance(mesh::SliceAt(of, times, parallel::Arena(2))[0],
                                              source.frames[static_cast<size_t>(frame)]) /
             mesh.edge_length_m;
    };
    EXPECT_LT(distance(mesh), distance(plain) + 0.01) << frame;
  }
}

// The blend's drop falls from between both heights. Without a pre-roll it hangs on the bridge.
TEST(PreRoll, ADropSeparatesTheEarlierTheHigherItIs) {
  const mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const mesh::Animation target = Drops({DropAt(0, kHigh)});
  const auto pre_roll = Find(source, {target});
  ASSERT_TRUE(pre_roll);
  const mesh::SpaceTimeMesh with = Build(source, *pre_roll), without = BuildMesh(source);
  const mesh::SpaceTimeMesh target_mesh = BuildMesh(target);
  const Registration cut = Registered(with, target_mesh), joined = Registered(without, target_mesh);
  const double volume = DropsOf(target.frames[0])[0].volume, edge_m = with.edge_length_m;
  for (const float weight : {0.25F, 0.5F, 0.75F, 1.0F}) {
    const auto drops = DropsOf(SliceBlend(with, cut, weight, 0));
    ASSERT_EQ(drops.size(), 1u) << weight;
    EXPECT_NEAR(drops[0].centre[2], kLow + weight * (kHigh - kLow), edge_m) << weight;
    EXPECT_NEAR(drops[0].volume / volume, 1, 0.1) << weight;
  }
  EXPECT_TRUE(DropsOf(SliceBlend(without, joined, 0.5F, 0)).empty());
  EXPECT_TRUE(DropsOf(SliceBlend(with, cut, 0, 0)).empty());
  // The target's drop strikes at frame 11: half-way in half that time.
  EXPECT_EQ(DropsOf(SliceBlend(with, cut, 0.5F, 3)).size(), 1u);
  EXPECT_TRUE(DropsOf(SliceBlend(with, cut, 0.5F, 9)).empty());
  EXPECT_EQ(DropsOf(SliceBlend(with, cut, 1, 8)).size(), 1u);
  // No weight lets it go below its place in the source.
  const std::vector<mesh::PartLife>& lives = cut.report.part_lives;
  ASSERT_EQ(lives.size(), 1u);
  EXPECT_EQ(lives[0].source_end_frames, 0);
  EXPECT_GT(lives[0].target_end_frames, 8);
  EXPECT_LE(lives[0].target_end_frames, 11);
}

TEST(PreRoll, EndsAnOpenStart) {
  const mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const mesh::Animation target = Drops({DropAt(0, kHigh)});
  const auto pre_roll = Find(source, {target});
  ASSERT_TRUE(pre_roll);
  const TestSurface with(Build(source, *pre_roll)), without(BuildMesh(source)),
      to(BuildMesh(target));
  const auto find = [&](const TestSurface& from) {
    const TrackOptions options{.min_diameter = kSmallestPart};
    return FindOpenStarts(FindTrackFeatures(from.surface, options),
                          FindTrackFeatures(to.surface, options),
                          ScaleOf(from.surface, to.surface));
  };
  EXPECT_FALSE(find(without).empty());
  EXPECT_TRUE(find(with).empty());
}

// The source has a pre-roll for another target's sake.
TEST(PreRoll, APartThatTheTargetDoesNotHaveIsNeverShown) {
  const mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const mesh::Animation joined = Drops({BridgedDropAt(0, kLow + 0.1)}), pool = Drops({});
  const auto pre_roll = Find(source, {Drops({DropAt(0, kHigh)})});
  ASSERT_TRUE(pre_roll);
  const mesh::SpaceTimeMesh mesh = Build(source, *pre_roll);
  for (const mesh::Animation* const target : {&joined, &pool}) {
    const Registration registration = Registered(mesh, BuildMesh(*target));
    EXPECT_THAT(registration.report.part_lives, testing::IsEmpty());
    for (const float weight : {0.5F, 1.0F}) {
      for (const double frame : {0.0, 1.0, 3.0}) {
        EXPECT_TRUE(DropsOf(SliceBlend(mesh, registration, weight, frame)).empty())
            << weight << " at " << frame << ", target " << (target == &pool ? "pool" : "joined");
      }
    }
  }
}

// As a user picks it: the drop's top in both first frames.
TEST(PreRoll, AUsersPointThatSaysTheSameChangesNothing) {
  const mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const mesh::Animation target = Drops({DropAt(0, kHigh)});
  const mesh::SpaceTimeMesh mesh = Build(source, *Find(source, {target}));
  Correspondence top;
  top.source = {0, 0, kLow + kDropRadius, 0};
  top.target = {0, 0, kHigh + kDropRadius, 0};
  const Registration registration = Registered(mesh, BuildMesh(target), 2, {top});
  EXPECT_EQ(DropsOf(SliceBlend(mesh, registration, 0.5F, 0)).size(), 1u);
  // Elsewhere is where the user wants it: the drop is not shown.
  top.target = {0.8, 0, 0, 10};
  const Registration elsewhere = Registered(mesh, BuildMesh(target), 2, {top});
  EXPECT_TRUE(DropsOf(SliceBlend(mesh, elsewhere, 0.5F, 0)).empty());
  EXPECT_THAT(elsewhere.report.verdict.reason, testing::HasSubstr("a part of the target"));
}

TEST(PreRoll, ADropThatFallsUntilTheLastFrameIsShown) {
  mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  mesh::Animation target = Drops({DropAt(0, kHigh)});
  source.frames.resize(7);
  target.frames.resize(7);
  const mesh::SpaceTimeMesh mesh = Build(source, *Find(source, {target}));
  const Registration registration = Registered(mesh, BuildMesh(target));
  EXPECT_EQ(DropsOf(SliceBlend(mesh, registration, 1, 0)).size(), 1u);
  EXPECT_EQ(DropsOf(SliceBlend(mesh, registration, 1, 4)).size(), 1u);
  EXPECT_EQ(DropsOf(SliceBlend(mesh, registration, 0.5F, 0)).size(), 1u);
}

// A refinement may be without, of a family that has a pre-roll.
TEST(PreRoll, WithoutAutomaticCorrespondencesNothingIsShownThatTheTargetDoesNotHave) {
  const mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const mesh::Animation joined = Drops({BridgedDropAt(0, kLow + 0.1)});
  const mesh::SpaceTimeMesh mesh = Build(source, *Find(source, {Drops({DropAt(0, kHigh)})}));
  const Registration registration = Registered(mesh, BuildMesh(joined), 2, {}, false);
  for (const float weight : {0.5F, 1.0F}) {
    for (const double frame : {0.0, 1.0, 3.0}) {
      EXPECT_TRUE(DropsOf(SliceBlend(mesh, registration, weight, frame)).empty())
          << weight << " at " << frame;
    }
  }
}

TEST(PreRoll, DropletsStayWhereTheyAre) {
  const mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const mesh::Animation target = Drops({DropAt(0, kHigh)});
  const auto find = [&](double area_edges2) {
    const mesh::TriangleMesh first[] = {target.frames[0]};
    return FindPreRoll(source.frames[0], first, mesh::Up::kZ, {kSmallestPart, area_edges2});
  };
  const double edge_m = mesh::MeanEdgeLength(source.frames[0]);
  const double area_edges2 = DropsOf(target.frames[0])[0].area / (edge_m * edge_m);
  EXPECT_TRUE(find(0.9 * area_edges2));
  EXPECT_FALSE(find(1.1 * area_edges2));
}

// Its frames rest, so that velocities make no layers between them.
TEST(PreRoll, FastFramesHaveNoLayersBetween) {
  mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const auto pre_roll = Find(source, {Drops({DropAt(0, kHigh)})});
  ASSERT_TRUE(pre_roll);
  PreRoll fast = *pre_roll;
  fast.surface.velocities.row(2).setConstant(40);  // a quarter of the scene's height a frame
  EXPECT_NEAR(static_cast<double>(Build(source, fast).num_vertices()),
              static_cast<double>(Build(source, *pre_roll).num_vertices()),
              0.02 * static_cast<double>(Build(source, *pre_roll).num_vertices()));
}

TEST(PreRoll, GivesTheSameBytesForAnyNumberOfThreads) {
  const mesh::Animation source = Drops({BridgedDropAt(0, kLow)});
  const mesh::Animation target = Drops({DropAt(0, kHigh)});
  const mesh::SpaceTimeMesh mesh = Build(source, *Find(source, {target}));
  const mesh::SpaceTimeMesh to = BuildMesh(target);
  EXPECT_EQ(Registered(mesh, to, 1).displacement, Registered(mesh, to, 8).displacement);
}

}  // namespace
}  // namespace liquidblend::registration::pre_roll_test

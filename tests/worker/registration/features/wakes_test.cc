#include "worker/registration/features/wakes.h"

#include <gmock/gmock.h>

#include "tests/synthetic/turned.h"
#include "tests/worker/registration/strike_testing.h"
#include "worker/registration/features/automatic.h"

namespace liquidblend::registration::wakes_test {
namespace {

constexpr StrikeOptions kLeft = {.x = -0.45, .crater_x = -0.45};
constexpr StrikeOptions kRight = {.x = 0.45, .crater_x = 0.45};

std::vector<Wake> Find(const mesh::SpaceTimeMesh& source_mesh,
                       const mesh::SpaceTimeMesh& target_mesh, int num_threads = 2) {
  const parallel::Arena arena(num_threads);
  const double edge = source_mesh.edge_length_m;
  const Surface source(source_mesh, edge, arena), target(target_mesh, edge, arena);
  const Features from = FindTrackFeatures(source), to = FindTrackFeatures(target);
  const FeaturePairs pairs = PairFeatures(from, to, ScaleOf(source, target));
  EXPECT_EQ(pairs.tracks.size(), 1u);
  return FindWakes(source, target, from, to, pairs.tracks, edge, arena);
}

std::vector<Wake> Find(const StrikeOptions& source, const StrikeOptions& target) {
  return Find(StrikeMesh(source), StrikeMesh(target));
}

TEST(FindWakes, ACraterThatTheDropMakesElsewhereGivesPointsAtItsBottom) {
  const mesh::SpaceTimeMesh source = StrikeMesh(kLeft);
  const auto wakes = Find(source, StrikeMesh(kRight));
  ASSERT_EQ(wakes.size(), 1u);
  ASSERT_GE(wakes[0].points.size(), 4u);
  const double edge_m = source.edge_length_m;
  double deepest = 0;
  for (const auto& [from, to] : wakes[0].points) {
    EXPECT_NEAR(edge_m * from[0], -0.45, edge_m);
    EXPECT_NEAR(edge_m * (to[0] - from[0]), 0.9, edge_m);
    EXPECT_NEAR(edge_m * (to[1] - from[1]), 0.0, edge_m);
    EXPECT_NEAR(to[2], from[2], 0.5);
    EXPECT_NEAR(to[3], from[3], 0.5);
    deepest = std::min(deepest, edge_m * from[2]);
  }
  EXPECT_NEAR(deepest, -0.45, edge_m);
}

TEST(FindWakes, TimesAreThoseAfterEachStrike) {
  const double later = 2;
  StrikeOptions target = kRight;
  target.start_frame = later;
  const auto wakes = Find(kLeft, target);
  ASSERT_EQ(wakes.size(), 1u);
  for (const auto& [from, to] : wakes[0].points) EXPECT_NEAR(to[3] - from[3], later, 0.5);
}

TEST(FindWakes, ADeeperCraterIsTheSameOne) {
  StrikeOptions target = kRight;
  target.crater_m = 0.55;
  const auto wakes = Find(kLeft, target);
  ASSERT_EQ(wakes.size(), 1u);
  for (const auto& [from, to] : wakes[0].points) EXPECT_LE(to[2], from[2] + 0.5);
}

TEST(FindWakes, AStrikeAtTheSamePlaceGivesNone) { EXPECT_TRUE(Find(kLeft, kLeft).empty()); }

TEST(FindWakes, WhatDoesNotFollowTheDropGivesNone) {
  StrikeOptions without = kRight;
  without.crater_m = 0;
  EXPECT_TRUE(Find(kLeft, without).empty()) << "no crater";
  StrikeOptions stays = kRight;
  stays.crater_x = kLeft.crater_x;
  EXPECT_TRUE(Find(kLeft, stays).empty()) << "a crater of something else, where the source's is";
}

TEST(FindWakes, WorksForAnyUpwardDirection) {
  const auto turned = [](const StrikeOptions& options) {
    mesh::Animation animation = StrikeAnimation(options);
    for (mesh::TriangleMesh& frame : animation.frames) {
      frame = synthetic::Turned(std::move(frame), mesh::Up::kMinusY);
    }
    animation.up = mesh::Up::kMinusY;
    return BuildMesh(animation);
  };
  const auto wakes = Find(turned(kLeft), turned(kRight));
  ASSERT_EQ(wakes.size(), 1u);
  EXPECT_GE(wakes[0].points.size(), 4u);
}

TEST(FindWakes, AreTheSameAtAnyNumberOfThreads) {
  const mesh::SpaceTimeMesh source = StrikeMesh(kLeft), target = StrikeMesh(kRight);
  const auto expected = Find(source, target, 1);
  ASSERT_EQ(expected.size(), 1u);
  for (const int num_threads : {2, 8}) {
    const auto found = Find(source, target, num_threads);
    ASSERT_EQ(found.size(), 1u);
    ASSERT_EQ(found[0].points.size(), expected[0].points.size());
    for (size_t n = 0; n < expected[0].points.size(); ++n) {
      EXPECT_EQ(found[0].points[n].source, expected[0].points[n].source);
      EXPECT_EQ(found[0].points[n].target, expected[0].points[n].target);
    }
  }
}

}  // namespace
}  // namespace liquidblend::registration::wakes_test

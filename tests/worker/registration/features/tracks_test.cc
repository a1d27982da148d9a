#include "worker/registration/features/tracks.h"

#include <gmock/gmock.h>

#include "core/mesh/slice_at.h"
#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration::tracks_test {
namespace {

synthetic::FallingDropsOptions OneDrop(double height_m, double velocity_m_per_s) {
  synthetic::FallingDropsOptions options;
  options.drops = {{{0.1, -0.1, height_m}, 0.25, 0}};
  options.velocity_m_per_s = velocity_m_per_s;
  options.pool_half_width_m = {0.6, 0.6};
  options.num_frames = 12;
  return options;
}

std::vector<Track> TracksOf(const TestSurface& test) {
  return FindTracks(FindParts(test.surface), test.mesh.num_frames);
}

// The first frame, or the last one, at which slices of the mesh have two parts.
int FrameWithTwoParts(const mesh::SpaceTimeMesh& mesh, bool first) {
  int found = -1;
  for (int frame = 0; frame < mesh.num_frames; ++frame) {
    const double time[] = {static_cast<double>(frame)};
    const auto slices = mesh::SliceAt(mesh, time, parallel::Arena(2));
    if (mesh::NumComponents(slices[0]) != 2) continue;
    if (!first || found < 0) found = frame;
  }
  return found;
}

TEST(Tracks, ABallThatFallsIntoAPoolIsOneTrackUntilItMerges) {
  const TestSurface test(BuildMesh(synthetic::FallingDrops(OneDrop(0.7, -1.2))));
  const std::vector<Track> tracks = TracksOf(test);
  ASSERT_EQ(tracks.size(), 1u);
  const Track& drop = tracks[0];
  EXPECT_EQ(drop.start, TrackStart::kFirstFrame);
  EXPECT_EQ(drop.end, TrackEnd::kMerge);
  EXPECT_EQ(drop.start_time, 0);
  EXPECT_NEAR(drop.end_time, FrameWithTwoParts(test.mesh, false), 1);
  const double edge = test.mesh.edge_length_m;
  EXPECT_NEAR(drop.diameter() * edge, 0.5, 0.5 * edge);
  for (const double time : {0.0, 3.25, drop.end_time}) {
    const Eigen::Vector3d centre = edge * drop.At(time).centre.head<3>();
    const Eigen::Vector3d exact(0.1, -0.1, 0.7 - 0.05 * time);
    EXPECT_LT((centre - exact).norm(), edge) << time;
  }
}

TEST(Tracks, WhatRisesOutOfAPoolBeginsWithASplit) {
  const TestSurface test(BuildMesh(synthetic::FallingDrops(OneDrop(0.1, 1.4))));
  const std::vector<Track> tracks = TracksOf(test);
  ASSERT_EQ(tracks.size(), 1u);
  EXPECT_EQ(tracks[0].start, TrackStart::kSplit);
  EXPECT_EQ(tracks[0].end, TrackEnd::kLastFrame);
  EXPECT_NEAR(tracks[0].start_time, FrameWithTwoParts(test.mesh, true), 1);
}

TEST(Tracks, APoolOrABallAloneHasNone) {
  synthetic::FallingDropsOptions pool = OneDrop(0, 0);
  pool.drops.clear();
  pool.num_frames = 4;
  EXPECT_TRUE(TracksOf(TestSurface(BuildMesh(synthetic::FallingDrops(pool)))).empty());
  EXPECT_TRUE(TracksOf(TestSurface(SphereMesh())).empty());
  EXPECT_TRUE(FindTracks({}, 8).empty());
}

// A pool of 1000 edges^3 in each slab from 0 on, part k in slab k, and whatever else is added.
struct MadeGraph {
  explicit MadeGraph(int num_slabs) {
    for (int slab = 0; slab < num_slabs; ++slab) Add(slab, 1000, 1000);
    for (int slab = 1; slab < num_slabs; ++slab) graph.links.push_back({slab - 1, slab});
  }
  int32_t Add(int slab, int64_t num_vertices, double volume) {
    Part part{.slab = slab, .num_vertices = num_vertices};
    part.centre[3] = slab - 0.5;
    part.volume = volume;
    graph.parts.push_back(part);
    return static_cast<int32_t>(graph.parts.size()) - 1;
  }
  // A drop of 100 edges^3 from one slab to another, links to the pool where they are detached.
  void AddDrop(int first, int last, bool splits, bool merges) {
    int32_t before = splits ? first - 1 : -1;
    for (int slab = first; slab <= last; ++slab) {
      const int32_t part = Add(slab, 100, 100);
      if (before >= 0) graph.links.push_back({before, part});
      before = part;
    }
    if (merges) graph.links.push_back({before, last + 1});
  }
  PartGraph graph;
};

TEST(Tracks, ATouchOfAFrameOrTwoDoesNotEndATrack) {
  MadeGraph made(21);
  made.AddDrop(0, 8, false, true);
  made.AddDrop(11, 16, true, true);
  const std::vector<Track> tracks = FindTracks(made.graph, 20);
  ASSERT_EQ(tracks.size(), 1u);
  EXPECT_EQ(tracks[0].start_time, 0);
  EXPECT_EQ(tracks[0].end_time, 16);
  MadeGraph apart(21);
  apart.AddDrop(0, 6, false, true);
  apart.AddDrop(12, 16, true, true);
  EXPECT_EQ(FindTracks(apart.graph, 20).size(), 2u) << "five frames are no touch";
}

TEST(Tracks, PartsThatComeAndGoAreNoise) {
  MadeGraph made(21);
  for (const int slab : {3, 9, 15}) made.AddDrop(slab, slab + 1, true, true);
  EXPECT_TRUE(FindTracks(made.graph, 20).empty());
  made.Add(5, 8, 2);  // a droplet
  EXPECT_TRUE(FindTracks(made.graph, 20).empty());
}

}  // namespace
}  // namespace liquidblend::registration::tracks_test

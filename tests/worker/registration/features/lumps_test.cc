#include "worker/registration/features/lumps.h"

#include <gmock/gmock.h>

#include "tests/worker/registration/drops_testing.h"

namespace liquidblend::registration::lumps_test {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

constexpr double kMinProminence = 4.0;  // edges

mesh::SpaceTimeMesh Pool(const std::vector<synthetic::SteadyDrop>& drops) {
  return Scene(drops, 1.2, 3);
}

// A drop that touches the pool.
synthetic::SteadyDrop BridgedAt(double x) { return DropAt(x, 0.9 * kDropRadius); }

TEST(FindLumps, ADropIsOneWhetherItIsApartOrTouchesThePool) {
  const TestSurface test(Pool({DropAt(-0.6, 0.7), BridgedAt(0.6)}));
  const double edge_m = test.mesh.edge_length_m;
  const std::vector<Lump> lumps = FindLumps(test.surface, kMinProminence);
  ASSERT_EQ(lumps.size(), 2u);
  // The grid's rows go along x: the higher top may come first or last.
  const Lump& left = lumps[lumps[0].place.x() < 0 ? 0 : 1];
  const Lump& right = lumps[lumps[0].place.x() < 0 ? 1 : 0];
  EXPECT_NEAR(edge_m * left.place.x(), -0.6, edge_m);
  EXPECT_NEAR(edge_m * right.place.x(), 0.6, edge_m);
  EXPECT_NEAR(edge_m * left.height, 0.7 + kDropRadius, edge_m);
  EXPECT_NEAR(edge_m * right.height, 1.9 * kDropRadius, edge_m);
  EXPECT_NEAR(edge_m * right.prominence, 1.9 * kDropRadius, edge_m);
  for (const Lump& lump : lumps) {
    EXPECT_NEAR(edge_m * lump.place.y(), 0, edge_m);
    EXPECT_NEAR(edge_m * lump.diameter, 2 * kDropRadius, 1.5 * edge_m);
  }
}

TEST(FindLumps, APoolAndALowHillAreNone) {
  EXPECT_TRUE(FindLumps(TestSurface(Pool({})).surface, kMinProminence).empty());
  const TestSurface hill(Pool({DropAt(0, 0.2 - kDropRadius)}));
  EXPECT_TRUE(FindLumps(hill.surface, kMinProminence).empty());
}

TEST(FindLumps, NothingInTheFirstFrameGivesNone) {
  const TestSurface test(Pool({}));
  mesh::SpaceTimeMesh empty = test.mesh;
  empty.hexahedra.clear();
  const parallel::Arena arena(1);
  EXPECT_TRUE(FindLumps(Surface(empty, empty.edge_length_m, arena), kMinProminence).empty());
}

TEST(FindLumps, LiquidFarApartTakesNoLargeGrid) {
  mesh::SpaceTimeMesh mesh = Pool({DropAt(0, 0.7)});
  for (int64_t v = 0; v < mesh.num_vertices(); ++v) {
    if (mesh.vertices(2, v) > 0.3f) mesh.vertices(0, v) += 1e6f;  // the drop
  }
  const Surface surface(mesh, mesh.edge_length_m, parallel::Arena(1));
  EXPECT_LE(FindLumps(surface, kMinProminence).size(), 1u);
}

TEST(PairLumps, GoByPlaceAndSize) {
  const auto at = [](double x, double diameter) {
    return Lump{.place = {x, 0}, .height = 10, .prominence = 10, .diameter = diameter};
  };
  const auto numbers = [](const std::vector<AssignedPair>& pairs) {
    std::vector<std::pair<int, int>> result;
    for (const AssignedPair& pair : pairs) result.emplace_back(pair.row, pair.column);
    return result;
  };
  const std::vector<Lump> source = {at(-10, 8), at(10, 8)};
  EXPECT_THAT(numbers(PairLumps(source, {at(12, 8), at(-9, 8)}, 40)),
              ElementsAre(Pair(0, 1), Pair(1, 0)));
  EXPECT_THAT(numbers(PairLumps(source, {at(-9, 20), at(3, 9)}, 40)), ElementsAre(Pair(1, 1)))
      << "one of another size";
  EXPECT_TRUE(PairLumps(source, {at(60, 8)}, 40).empty()) << "too far";
  EXPECT_TRUE(PairLumps(source, {}, 40).empty());
}

// Two animations: the left drop touches the pool in one, the right one in the other.
TEST(FindJoinedTracks, ADropThatIsApartInOneOnlyIsNotTheOtherOne) {
  const TestSurface a(Pool({BridgedAt(-0.6), DropAt(0.6, 0.7)}));
  const TestSurface b(Pool({DropAt(-0.6, 0.7), BridgedAt(0.6)}));
  const auto tracks_of = [](const TestSurface& test) {
    return FindTracks(FindParts(test.surface), test.mesh.num_frames);
  };
  const auto a_tracks = tracks_of(a), b_tracks = tracks_of(b);
  ASSERT_EQ(a_tracks.size(), 1u);
  ASSERT_EQ(b_tracks.size(), 1u);
  const auto a_lumps = FindLumps(a.surface, kMinProminence);
  const auto b_lumps = FindLumps(b.surface, kMinProminence);
  const auto joined = [&](const std::vector<Track>& tracks, const std::vector<Lump>& lumps) {
    return FindJoinedTracks({a_tracks, a_lumps}, {tracks, lumps}, PairLumps(a_lumps, lumps, 40),
                            a.mesh.up, 0.5);
  };
  const std::vector<JoinedTrack> found = joined(b_tracks, b_lumps);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].track, 0);
  EXPECT_GT(a_lumps[found[0].own_lump].place[0], 0);
  EXPECT_GT(b_lumps[found[0].other_lump].place[0], 0);
  EXPECT_TRUE(joined(a_tracks, a_lumps).empty()) << "apart in both";
  EXPECT_TRUE(joined(b_tracks, {}).empty()) << "nothing is known";
}

}  // namespace
}  // namespace liquidblend::registration::lumps_test

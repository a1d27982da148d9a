#include "worker/spacetime/tracked/build_tracked.h"
#include "worker/spacetime/build.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/slice/slice.h"
#include "tests/synthetic/families.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/slice_family.h"
#include "tests/synthetic/surface_distance.h"
#include "tests/synthetic/tracked.h"
#include "worker/spacetime/build.h"

namespace liquidblend::spacetime::build_tracked_test {
namespace {

using ::testing::HasSubstr;

TrackedLinks LinksOrDie(const mesh::Animation& animation, const TrackedOptions& options = {}) {
  auto links = TrackLinks(animation, options, parallel::Arena(2));
  EXPECT_TRUE(links.ok()) << links.status();
  return *std::move(links);
}

mesh::SpaceTimeMesh BuildOrDie(const mesh::Animation& animation, int num_threads = 2,
                               const TrackedOptions& options = {}) {
  const parallel::Arena arena(num_threads);
  const auto links = TrackLinks(animation, options, arena);
  EXPECT_TRUE(links.ok()) << links.status();
  auto mesh = BuildTracked(animation, *links, options, arena);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

mesh::TriangleMesh Cut(const slice::CellIndex& index, const std::vector<double>& weights,
                       double time_frames) {
  return synthetic::SliceFamily(index, weights, time_frames / index.family().frames_per_second);
}

mesh::TriangleMesh Cut(const mesh::SpaceTimeMesh& mesh, double time_frames) {
  const mesh::RegisteredFamily family = mesh::ViewOf(mesh);
  return Cut(slice::CellIndex(family), {}, time_frames);
}

std::vector<mesh::Animation> AllSequences(int subdivisions = 3) {
  synthetic::RemeshingOptions remeshing;
  remeshing.sequence.subdivisions = subdivisions;
  const synthetic::TrackedSequenceOptions& options = remeshing.sequence;
  return {synthetic::SphereToEllipsoid(options), synthetic::RemeshedEllipsoid(remeshing),
          synthetic::MergingSpheres(options), synthetic::SplittingSpheres(options),
          synthetic::ReplacedEllipsoid(options)};
}

TEST(BuildTracked, IsClosedAndOriented) {
  for (const mesh::Animation& animation : AllSequences()) {
    for (const double cone_radius_edges : {0.0, 3.0, 64.0}) {
      TrackedOptions options;
      options.cone_radius_edges = cone_radius_edges;
      const auto mesh = BuildOrDie(animation, 2, options);
      const absl::Status valid = mesh::Validate(mesh);
      EXPECT_TRUE(valid.ok()) << animation.name << ", " << cone_radius_edges << ": " << valid;
    }
  }
}

struct Query {
  std::vector<double> weights;
  double time_frames;
};

// Every fourth at a frame, where vertices lie in the hyperplane.
std::vector<Query> RandomQueries(int num_frames, int count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> weight(blend::kMinWeight, blend::kMaxWeight);
  std::uniform_real_distribution<double> time(0.0, num_frames - 1);
  std::vector<Query> queries(count);
  for (int q = 0; q < count; ++q) {
    queries[q] = {{weight(random), weight(random)}, time(random)};
    if (q % 4 == 0) queries[q].time_frames = std::floor(queries[q].time_frames);
  }
  return queries;
}

TEST(BuildTracked, HasNoHoleInAThousandWarpedSlices) {
  const parallel::Arena arena(2);
  for (const mesh::Animation& animation : AllSequences(2)) {
    const mesh::RegisteredFamily family = synthetic::MakeFamily(
        BuildOrDie(animation),
        {{synthetic::SmoothWarp(1, 0.5f, 4.0f), synthetic::SmoothWarp(2, 0.3f, 2.0f)},
         {synthetic::SmoothWarp(3, 0.3f, 3.0f), {}}});
    const slice::CellIndex index(family);
    const std::vector<Query> queries = RandomQueries(family.num_frames, 1000);
    std::vector<mesh::ClosednessReport> reports(queries.size());
    std::vector<int64_t> num_triangles(queries.size());
    arena.For(
        static_cast<int64_t>(queries.size()),
        [&](int64_t q) {
          const auto surface = Cut(index, queries[q].weights, queries[q].time_frames);
          reports[q] = mesh::CheckClosed(surface);
          num_triangles[q] = surface.num_triangles();
        },
        50);
    int64_t num_odd = 0;
    int64_t num_misoriented = 0;
    for (const mesh::ClosednessReport& report : reports) {
      num_odd += report.num_odd_edges;
      num_misoriented += report.num_misoriented_edges;
    }
    EXPECT_EQ(num_odd, 0) << animation.name;
    EXPECT_EQ(num_misoriented, 0) << animation.name;
    EXPECT_GT(*std::min_element(num_triangles.begin(), num_triangles.end()), 50) << animation.name;
  }
}

TEST(BuildTracked, TheWarpOfTheseTestsFoldsTime) {
  const mesh::SpaceTimeMesh mesh = BuildOrDie(synthetic::SphereToEllipsoid());
  const synthetic::Field warp = synthetic::SmoothWarp(1, 0.5f, 4.0f);
  int64_t num_folded = 0;
  for (const mesh::Wedge& wedge : mesh.wedges) {
    const Eigen::Vector4f low = mesh.vertices.col(wedge[0]);
    const Eigen::Vector4f high = mesh.vertices.col(wedge[3]);
    num_folded += low[3] + warp(0, low)[3] > high[3] + warp(0, high)[3];
  }
  EXPECT_GT(num_folded, 500);
}

// Largest distance of a vertex of either surface to the other, in mean edges.
double LargestDistanceEdges(const mesh::TriangleMesh& a, const mesh::TriangleMesh& b) {
  const synthetic::SurfaceDistance to_a(a);
  const synthetic::SurfaceDistance to_b(b);
  float largest = 0;
  for (int64_t v = 0; v < a.num_vertices(); ++v) {
    largest = std::max(largest, to_b.Distance(a.vertices.col(v)));
  }
  for (int64_t v = 0; v < b.num_vertices(); ++v) {
    largest = std::max(largest, to_a.Distance(b.vertices.col(v)));
  }
  return largest / mesh::MeanEdgeLength(b);
}

TEST(BuildTracked, ReproducesEveryFrameToAHundredThousandthOfAnEdge) {
  for (const mesh::Animation& animation : AllSequences()) {
    const auto mesh = BuildOrDie(animation);
    for (int k = 0; k < animation.num_frames(); ++k) {
      const mesh::TriangleMesh surface = Cut(mesh, k);
      EXPECT_LT(LargestDistanceEdges(surface, animation.frames[k]), 1e-5)
          << animation.name << ", frame " << k;
      EXPECT_NEAR(mesh::Volume(surface) / mesh::Volume(animation.frames[k]), 1.0, 1e-5)
          << animation.name << ", frame " << k;
    }
  }
}

TEST(BuildTracked, OfFixedConnectivityHasWedgesOnlyAndTheFramesOwnTriangles) {
  const mesh::Animation animation = synthetic::SphereToEllipsoid();
  const auto mesh = BuildOrDie(animation);
  EXPECT_EQ(static_cast<int64_t>(mesh.wedges.size()),
            animation.frames[0].num_triangles() * (animation.num_frames() + 1));
  EXPECT_EQ(mesh.num_cells(), static_cast<int64_t>(mesh.wedges.size()));
  for (const double frame : {0.0, 3.0, 3.5, 7.0}) {
    EXPECT_EQ(Cut(mesh, frame).num_triangles(), animation.frames[0].num_triangles()) << frame;
  }
}

TEST(BuildTracked, KeepsTheVolumeBetweenFrames) {
  // The neck of two merging bodies appears within one step.
  constexpr double kTolerance = 0.04;
  for (const mesh::Animation& animation : AllSequences()) {
    const auto mesh = BuildOrDie(animation);
    for (int k = 0; k + 1 < animation.num_frames(); ++k) {
      for (const double share : {0.25, 0.5, 0.75}) {
        const double expected = (1.0 - share) * mesh::Volume(animation.frames[k]) +
                                share * mesh::Volume(animation.frames[k + 1]);
        EXPECT_NEAR(mesh::Volume(Cut(mesh, k + share)) / expected, 1.0, kTolerance)
            << animation.name << ", frame " << k + share;
      }
    }
  }
}

TEST(BuildTracked, ALargeRebuiltPartWouldSinkToAPointInOneCone) {
  const mesh::Animation animation = synthetic::ReplacedEllipsoid();
  const double between = animation.num_frames() / 2 - 0.5;
  const double expected = mesh::Volume(animation.frames[animation.num_frames() / 2]);
  TrackedOptions one_cone;
  one_cone.cone_radius_edges = 64;
  EXPECT_LT(mesh::Volume(Cut(BuildOrDie(animation, 2, one_cone), between)) / expected, 0.5);
  EXPECT_GT(mesh::Volume(Cut(BuildOrDie(animation), between)) / expected, 0.9);
}

TEST(BuildTracked, ChangesTheNumberOfPartsWhereTheAnimationDoes) {
  const mesh::Animation merging = synthetic::MergingSpheres();
  const auto mesh = BuildOrDie(merging);
  EXPECT_EQ(mesh::NumComponents(Cut(mesh, 0)), 2);
  EXPECT_EQ(mesh::NumComponents(Cut(mesh, 7)), 1);
  const auto reverse = BuildOrDie(synthetic::SplittingSpheres());
  EXPECT_EQ(mesh::NumComponents(Cut(reverse, 0)), 1);
  EXPECT_EQ(mesh::NumComponents(Cut(reverse, 7)), 2);
}

TEST(BuildTracked, TakesAFlippedSplitOrCollapsedEdgeForFewCells) {
  for (const int operation : {0, 1, 2}) {
    synthetic::RemeshingOptions options;
    options.sequence.num_frames = 2;
    options.flips_per_frame = operation == 0;
    options.splits_per_frame = operation == 1;
    options.collapses_per_frame = operation == 2;
    const auto mesh = BuildOrDie(synthetic::RemeshedEllipsoid(options));
    EXPECT_EQ(mesh.pyramids.size(), 4u) << operation;
    const std::vector<size_t> num_tetrahedra = {4, 6, 2};
    EXPECT_EQ(mesh.tetrahedra.size(), num_tetrahedra[operation]) << operation;
  }
}

TEST(BuildTracked, CarriesVelocitiesAndNormals) {
  const auto mesh = BuildOrDie(synthetic::RemeshedEllipsoid());
  ASSERT_EQ(mesh.velocities.cols(), mesh.num_vertices());
  ASSERT_EQ(mesh.normals.cols(), mesh.num_vertices());
  const float rate = 24 * 0.05f;
  for (int64_t v = 0; v < mesh.num_vertices(); ++v) {
    const Eigen::Vector3f p = mesh.vertices.col(v).head<3>();
    const float x_at_0 = p.x() / (1 + 0.05f * mesh.vertices(3, v));
    EXPECT_NEAR(mesh.velocities(0, v), rate * x_at_0, 0.02f) << v;
    EXPECT_GT(mesh.normals.col(v).head<3>().dot(p), 0.1f) << v;
  }
}

TEST(BuildTracked, PutsFramesAtTheirTimes) {
  mesh::Animation animation = synthetic::SphereToEllipsoid();
  animation.times = {0, 1, 2, 5, 5.5, 6, 7, 8.5};
  const auto mesh = BuildOrDie(animation);
  EXPECT_TRUE(mesh::Validate(mesh).ok()) << mesh::Validate(mesh);
  EXPECT_EQ(mesh.num_frames, 9);
  EXPECT_LT(LargestDistanceEdges(Cut(mesh, 5.5), animation.frames[4]), 1e-5);
}

TEST(BuildTracked, KeepsLiquidThatAppearsAndDisappears) {
  mesh::Animation animation;
  animation.frames.assign(6, mesh::TriangleMesh{});
  for (int k = 2; k < 4; ++k) animation.frames[k] = synthetic::Icosphere({0, 0, 0}, 1.0, 3);
  const auto mesh = BuildOrDie(animation);
  EXPECT_TRUE(mesh::Validate(mesh).ok()) << mesh::Validate(mesh);
  EXPECT_EQ(Cut(mesh, 0).num_triangles(), 0);
  EXPECT_NEAR(mesh::Volume(Cut(mesh, 2.5)), mesh::Volume(animation.frames[2]), 1e-4);
  EXPECT_EQ(Cut(mesh, 5).num_triangles(), 0);
}

TEST(BuildTracked, SameBytesAtAnyThreadCount) {
  for (const mesh::Animation& animation : AllSequences()) {
    const auto one = BuildOrDie(animation, 1);
    for (const int num_threads : {2, 8}) {
      const auto many = BuildOrDie(animation, num_threads);
      ASSERT_EQ(many.num_vertices(), one.num_vertices());
      const auto same = [](const auto& a, const auto& b) {
        return a.size() == b.size() && std::memcmp(a.data(), b.data(), 4 * a.size()) == 0;
      };
      EXPECT_TRUE(same(many.vertices, one.vertices)) << animation.name;
      EXPECT_TRUE(same(many.normals, one.normals)) << animation.name;
      EXPECT_TRUE(same(many.velocities, one.velocities)) << animation.name;
      EXPECT_EQ(many.wedges, one.wedges) << animation.name;
      EXPECT_EQ(many.pyramids, one.pyramids) << animation.name;
      EXPECT_EQ(many.tetrahedra, one.tetrahedra) << animation.name;
    }
  }
}

TEST(TrackLinks, SaysHowMuchOfAnAnimationIsTracked) {
  EXPECT_EQ(LinksOrDie(synthetic::SphereToEllipsoid()).matched_share, 1.0);
  const TrackedLinks remeshed = LinksOrDie(synthetic::RemeshedEllipsoid());
  EXPECT_GT(remeshed.lowest_share, 0.93);
  const TrackedLinks merging = LinksOrDie(synthetic::MergingSpheres());
  EXPECT_GT(merging.lowest_share, 0.8);
  EXPECT_EQ(merging.lowest_step, 3);
  const TrackedLinks replaced = LinksOrDie(synthetic::ReplacedEllipsoid());
  EXPECT_LT(replaced.lowest_share, 0.5);  // by chance
  EXPECT_EQ(replaced.lowest_step, 3);
  EXPECT_GT(replaced.matched_share, 0.8);
}

TEST(MatchedShare, TellsTrackedFromRebuiltFrames) {
  constexpr double kTracked = 0.85;  // those here 0.93 and more, rebuilt ones 0.71 and less
  const parallel::Arena arena(2);
  for (mesh::Animation animation : AllSequences()) {
    EXPECT_GT(MatchedShare(animation, {}, arena).value_or(0), kTracked) << animation.name;
    for (mesh::TriangleMesh& frame : animation.frames) frame.velocities.resize(3, 0);
    EXPECT_GT(MatchedShare(animation, {}, arena).value_or(0), kTracked) << animation.name;
  }
  // Most of its triangles are those of a pool at rest, the same in all frames.
  EXPECT_LT(MatchedShare(synthetic::FallingDrop(), {}, arena).value_or(1), kTracked);
}

TEST(ChooseConnectivity, IsWhatIsAskedForOrElseWhatTheFramesShow) {
  const parallel::Arena arena(1);
  const mesh::Animation tracked = synthetic::SphereToEllipsoid();
  BuildOptions options;
  EXPECT_EQ(*ChooseConnectivity(tracked, options, arena), Connectivity::kTracked);
  EXPECT_EQ(*ChooseConnectivity(synthetic::FallingDrop(), options, arena), Connectivity::kRebuilt);
  options.connectivity = Connectivity::kRebuilt;
  EXPECT_EQ(*ChooseConnectivity(tracked, options, arena), Connectivity::kRebuilt);
  options.spacing_edges = 5;
  EXPECT_EQ(std::string(ChooseConnectivity(tracked, options, arena).status().message()),
            "spacing_edges is 5, not in [0.25, 4]");
}

TEST(MatchedShare, IsOneWhereNothingMoves) {
  mesh::Animation still = synthetic::SphereToEllipsoid();
  for (mesh::TriangleMesh& frame : still.frames) frame = still.frames[0];
  EXPECT_EQ(MatchedShare(still, {}, parallel::Arena(1)).value_or(0), 1.0);
}

TEST(TrackLinks, RefusesWhatItCannotUseAndSaysWhy) {
  const parallel::Arena arena(1);
  mesh::Animation single = synthetic::SphereToEllipsoid();
  single.frames.resize(1);
  EXPECT_THAT(TrackLinks(single, {}, arena).status().message(), HasSubstr("1 frames"));
  TrackedOptions options;
  options.reach_edges = 9;
  EXPECT_THAT(TrackLinks(synthetic::SphereToEllipsoid(), options, arena).status().message(),
              HasSubstr("reach_edges is 9"));
}

}  // namespace
}  // namespace liquidblend::spacetime::build_tracked_test

#include "core/mesh/slice_at.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/base/data_limit.h"
#include "core/slice/slice.h"
#include "tests/allocation_testing.h"
#include "tests/synthetic/families.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/slice_family.h"
#include "worker/spacetime/build.h"

namespace liquidblend::mesh {
namespace {

const std::vector<double> kTimes = {0, 1, 2.5, 3.25, 7};

mesh::TriangleMesh AsServed(const mesh::SpaceTimeMesh& mesh, double time) {
  const mesh::RegisteredFamily family = mesh::ViewOf(mesh);
  return synthetic::SliceFamily(slice::CellIndex(family), {}, time / family.frames_per_second);
}

// The vertices in an order that does not depend on who made them.
std::vector<std::array<float, 3>> Sorted(const mesh::TriangleMesh& surface) {
  std::vector<std::array<float, 3>> points;
  for (int64_t v = 0; v < surface.num_vertices(); ++v) {
    points.push_back({surface.vertices(0, v), surface.vertices(1, v), surface.vertices(2, v)});
  }
  std::sort(points.begin(), points.end());
  return points;
}

void ExpectAsServed(const mesh::SpaceTimeMesh& mesh) {
  const std::vector<mesh::TriangleMesh> slices = SliceAt(mesh, kTimes, parallel::Arena(2));
  ASSERT_EQ(slices.size(), kTimes.size());
  for (size_t n = 0; n < kTimes.size(); ++n) {
    const mesh::TriangleMesh served = AsServed(mesh, kTimes[n]);
    ASSERT_GT(served.num_triangles(), 0);
    EXPECT_EQ(slices[n].num_triangles(), served.num_triangles()) << kTimes[n];
    EXPECT_EQ(Sorted(slices[n]), Sorted(served)) << kTimes[n];
    EXPECT_TRUE(mesh::CheckClosed(slices[n]).closed()) << kTimes[n];
    // 0.1 %: polygons of five corners may be cut otherwise.
    EXPECT_NEAR(mesh::Volume(slices[n]) / mesh::Volume(served), 1.0, 1e-3) << kTimes[n];
  }
}

// Cells that last long are cut by many slices. A list of the cells of each slice would take 17 MB.
TEST(SliceAt, MemoryDoesNotFollowTheDurationOfCells) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  synthetic::ComplexOptions options;
  options.num_frames = 2;
  SpaceTimeMesh mesh = synthetic::HexahedralSphere(12, options);
  constexpr int kNumSlices = 5000;
  std::vector<double> times(kNumSlices);
  for (int n = 0; n < kNumSlices; ++n) times[n] = static_cast<double>(n) / kNumSlices;
  int64_t num_slices = 0;
  const base::ScopedDataLimit limit(8 << 20);
  VisitSlices(mesh, mesh.vertices, times, parallel::Arena(1),
              [&](int64_t, const TracedSlice&) { ++num_slices; });
  EXPECT_EQ(num_slices, kNumSlices);
}

TEST(SliceAt, ShowsWhatTheServerShowsOfEachCellKind) {
  synthetic::ComplexOptions moving;
  moving.velocity_m_per_frame = {0.1F, 0, 0};
  moving.growth_per_frame = 0.05F;
  ExpectAsServed(synthetic::HexahedralSphere(8, moving));
  ExpectAsServed(synthetic::WedgeSphere(2, moving));
  ExpectAsServed(synthetic::TetrahedralSphere(2, moving));
  ExpectAsServed(synthetic::MixedSphere(8, moving));
}

TEST(SliceAt, ShowsWhatTheServerShowsOfAChangeOfTopology) {
  const auto mesh = spacetime::Build(synthetic::FallingDrop(), {}, parallel::Arena(2));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectAsServed(*mesh);
}

TEST(SliceAt, HasTheSameBytesForAnyNumberOfThreads) {
  const mesh::SpaceTimeMesh mesh = synthetic::MixedSphere(6);
  const auto one = SliceAt(mesh, kTimes, parallel::Arena(1));
  const auto eight = SliceAt(mesh, kTimes, parallel::Arena(8));
  for (size_t n = 0; n < kTimes.size(); ++n) {
    EXPECT_EQ(one[n].vertices, eight[n].vertices);
    EXPECT_EQ(one[n].triangles, eight[n].triangles);
  }
}

TEST(VisitSlices, KnowsTheEdgeOfEachVertex) {
  const mesh::SpaceTimeMesh mesh = synthetic::MixedSphere(6);
  const auto slices = SliceAt(mesh, kTimes, parallel::Arena(2));
  std::vector<int> num_visits(kTimes.size(), 0);
  VisitSlices(mesh, mesh.vertices, kTimes, parallel::Arena(2), [&](int64_t n, TracedSlice slice) {
    ++num_visits[n];
    EXPECT_EQ(slice.surface.vertices, slices[n].vertices);
    EXPECT_EQ(slice.surface.triangles, slices[n].triangles);
    ASSERT_EQ(static_cast<int64_t>(slice.edges.size()), slice.surface.num_vertices());
    for (size_t v = 0; v < slice.edges.size(); ++v) {
      const auto [a, b] = slice.edges[v];
      ASSERT_LT(a, b);
      const Eigen::Vector4f from = mesh.vertices.col(a), to = mesh.vertices.col(b);
      const float share = (static_cast<float>(kTimes[n]) - from.w()) / (to.w() - from.w());
      ASSERT_GE(share, 0.0F);
      ASSERT_LE(share, 1.0F);
      const Eigen::Vector3f expected = (from + share * (to - from)).head<3>();
      // Rounding of numbers about 1.
      ASSERT_LT((slice.surface.vertices.col(static_cast<int64_t>(v)) - expected).norm(), 1e-5F);
    }
  });
  EXPECT_EQ(num_visits, std::vector<int>(kTimes.size(), 1));
}

}  // namespace
}  // namespace liquidblend::mesh

#include "tests/reference/paper_extraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "core/slice/slice.h"
#include "tests/synthetic/families.h"
#include "tests/synthetic/slice_family.h"
#include "tests/synthetic/surface_distance.h"
#include "tests/synthetic/tracked.h"
#include "worker/spacetime/tracked/build_tracked.h"

namespace liquidblend::reference {
namespace {

constexpr double kAgreementEdges = 0.1;

mesh::SpaceTimeMesh BuildOrDie(const mesh::Animation& animation) {
  const parallel::Arena arena(2);
  const auto links = spacetime::TrackLinks(animation, {}, arena);
  EXPECT_TRUE(links.ok()) << links.status();
  auto mesh = spacetime::BuildTracked(animation, *links, {}, arena);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

mesh::TriangleMesh OurSlice(const mesh::SpaceTimeMesh& mesh, double time_frames) {
  const mesh::RegisteredFamily family = mesh::ViewOf(mesh);
  return synthetic::SliceFamily(slice::CellIndex(family), {},
                                time_frames / family.frames_per_second);
}

// A registration's displacement, as far as it moves without folding.
void Warp(mesh::SpaceTimeMesh& mesh) {
  const synthetic::Field warp = synthetic::SmoothWarp(1, 0.05f, 0.4f);
  for (int64_t v = mesh.num_first_vertices; v < mesh.num_vertices() - mesh.num_last_vertices; ++v) {
    mesh.vertices.col(v) += warp(v, mesh.vertices.col(v));
  }
}

std::vector<mesh::Animation> Sequences() {
  return {synthetic::SphereToEllipsoid(), synthetic::RemeshedEllipsoid(),
          synthetic::MergingSpheres(), synthetic::SplittingSpheres()};
}

TEST(SplitWedges, MakesAValidMeshOfTypeOnePrisms) {
  mesh::SpaceTimeMesh mesh = BuildOrDie(synthetic::SphereToEllipsoid());
  mesh.tetrahedra = SplitWedges(mesh.wedges);
  EXPECT_EQ(mesh.tetrahedra.size(), 3 * mesh.wedges.size());
  mesh.wedges.clear();
  EXPECT_TRUE(mesh::Validate(mesh).ok()) << mesh::Validate(mesh);
}

TEST(SplitWedges, PutsDiagonalsToTheHigherLabel) {
  const std::vector<mesh::Wedge> wedge = {{7, 3, 5, 17, 13, 15}};
  std::set<std::pair<int, int>> edges;
  for (const mesh::Tetrahedron& cell : SplitWedges(wedge)) {
    for (const int a : cell) {
      for (const int b : cell) edges.emplace(a, b);
    }
  }
  EXPECT_TRUE(edges.count({3, 15}) && edges.count({3, 17}) && edges.count({5, 17}));
  EXPECT_FALSE(edges.count({5, 13}) || edges.count({7, 13}) || edges.count({7, 15}));
}

TEST(SliceTetrahedra, IsClosedAndOrientedWithoutHoles) {
  mesh::SpaceTimeMesh mesh = BuildOrDie(synthetic::SphereToEllipsoid());
  Warp(mesh);
  const std::vector<mesh::Tetrahedron> tetrahedra = SplitWedges(mesh.wedges);
  for (const double time : {0.0, 1.3, 2.5, 7.0}) {
    mesh::TriangleMesh surface = SliceTetrahedra(mesh.vertices, tetrahedra, time);
    EXPECT_TRUE(mesh::CheckClosed(surface).closed()) << time;
    EXPECT_GT(mesh::Volume(surface), 3.0) << time;
    const int64_t num_triangles = surface.num_triangles();
    FillHoles(surface);
    EXPECT_EQ(surface.num_triangles(), num_triangles) << time;
  }
}

TEST(PaperExtraction, AgreesWithOurSlices) {
  for (const mesh::Animation& animation : Sequences()) {
    for (const bool is_warped : {false, true}) {
      mesh::SpaceTimeMesh mesh = BuildOrDie(animation);
      if (is_warped) Warp(mesh);
      const std::vector<mesh::Tetrahedron> tetrahedra = SplitWedges(mesh.wedges);
      for (const double time : {0.0, 1.3, 2.5, 3.5, 4.0, 5.8, 7.0}) {
        const mesh::TriangleMesh theirs = ExtractAsInThePaper(mesh.vertices, tetrahedra, time);
        const mesh::TriangleMesh ours = OurSlice(mesh, time);
        EXPECT_TRUE(mesh::CheckClosed(theirs).closed()) << animation.name << " at " << time;
        const double apart = synthetic::MeanSymmetricDistance(ours, theirs) / mesh.edge_length_m;
        EXPECT_LT(apart, kAgreementEdges)
            << animation.name << " at " << time << (is_warped ? ", warped" : "");
        // Where bodies merge, one fan closes what ours fills with the two caps on their way.
        EXPECT_NEAR(mesh::Volume(theirs) / mesh::Volume(ours), 1.0, 0.1) << animation.name;
      }
    }
  }
}

TEST(PaperExtraction, AgreesWithOurSlicesEverywhereIfConnectivityIsFixed) {
  mesh::SpaceTimeMesh mesh = BuildOrDie(synthetic::SphereToEllipsoid());
  Warp(mesh);
  const std::vector<mesh::Tetrahedron> tetrahedra = SplitWedges(mesh.wedges);
  for (const double time : {0.0, 1.3, 2.5, 7.0}) {
    const mesh::TriangleMesh theirs = ExtractAsInThePaper(mesh.vertices, tetrahedra, time);
    const synthetic::SurfaceDistance to_theirs(theirs);
    const mesh::TriangleMesh ours = OurSlice(mesh, time);
    float largest = 0;
    for (int64_t v = 0; v < ours.num_vertices(); ++v) {
      largest = std::max(largest, to_theirs.Distance(ours.vertices.col(v)));
    }
    EXPECT_LT(largest, kAgreementEdges * mesh.edge_length_m) << time;
  }
}

TEST(PaperExtraction, MakesMoreTrianglesAndMoreSliversThanOurs) {
  const mesh::SpaceTimeMesh mesh = BuildOrDie(synthetic::SphereToEllipsoid());
  const mesh::TriangleMesh theirs = SliceTetrahedra(mesh.vertices, SplitWedges(mesh.wedges), 2.4);
  const mesh::TriangleMesh ours = OurSlice(mesh, 2.4);
  EXPECT_EQ(theirs.num_triangles(), 4 * ours.num_triangles());
  EXPECT_EQ(NumSlivers(ours), 0);
  EXPECT_GT(NumSlivers(SliceTetrahedra(mesh.vertices, SplitWedges(mesh.wedges), 2.05)), 1000);
}

TEST(RadiusRatio, IsOneForAnEquilateralTriangleAndZeroForALine) {
  EXPECT_NEAR(RadiusRatio({1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1.0, 1e-6);
  EXPECT_NEAR(RadiusRatio({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), 2 * (std::sqrt(2.0) - 1), 1e-6);
  EXPECT_EQ(RadiusRatio({0, 0, 0}, {1, 0, 0}, {3, 0, 0}), 0.0);
}

}  // namespace
}  // namespace liquidblend::reference

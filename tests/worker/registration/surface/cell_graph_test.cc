#include "worker/registration/surface/cell_graph.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/synthetic/families.h"

namespace liquidblend::registration {
namespace {

TEST(CellGraph, NeighborsShareACellAndAreMutual) {
  const mesh::SpaceTimeMesh mesh = synthetic::MixedSphere(4);
  const PackedLists cells = CellsAroundVertices(mesh, parallel::Arena(2));
  const PackedLists neighbors = VertexNeighbors(mesh, cells, parallel::Arena(2));
  ASSERT_EQ(neighbors.num_rows(), mesh.num_vertices());
  std::set<std::pair<int32_t, int32_t>> expected;
  for (int64_t c = 0; c < mesh.num_cells(); ++c) {
    for (const int32_t v : CornersOf(mesh, c)) {
      for (const int32_t w : CornersOf(mesh, c)) {
        if (v != w) expected.insert({v, w});
      }
    }
  }
  std::set<std::pair<int32_t, int32_t>> found;
  for (int32_t v = 0; v < mesh.num_vertices(); ++v) {
    for (const int32_t w : neighbors[v]) EXPECT_TRUE(found.insert({v, w}).second);
  }
  EXPECT_EQ(found, expected);
}

TEST(CellGraph, SameListsAtAnyThreadCount) {
  const mesh::SpaceTimeMesh mesh = synthetic::HexahedralSphere(16);
  const PackedLists cells = CellsAroundVertices(mesh, parallel::Arena(2));
  const PackedLists one = VertexNeighbors(mesh, cells, parallel::Arena(1));
  const PackedLists eight = VertexNeighbors(mesh, cells, parallel::Arena(8));
  EXPECT_TRUE(one == eight);
}

TEST(GeodesicSearch, MeasuresAlongTheSurfaceNotThroughIt) {
  synthetic::ComplexOptions options;
  options.num_frames = 3;
  const mesh::SpaceTimeMesh mesh = synthetic::HexahedralSphere(24, options);
  const PackedLists cells = CellsAroundVertices(mesh, parallel::Arena(2));
  const PackedLists neighbors = VertexNeighbors(mesh, cells, parallel::Arena(1));
  const Points points = InEdgeUnits(mesh.vertices, 1.0);
  const int32_t from = static_cast<int32_t>(mesh.num_first_vertices);  // a vertex of frame 0
  GeodesicSearch search(points, neighbors);
  double farthest = 0;
  for (const auto& reached : search.From(from, 2.0f)) {
    const Eigen::Vector3f a = points.col(from).head<3>(), b = points.col(reached.vertex).head<3>();
    if (points(3, from) != points(3, reached.vertex)) continue;
    const double arc = std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0f, 1.0f));
    // Paths turn from edge to edge, and acos() is rough near 0.
    EXPECT_GE(reached.distance, 0.97 * arc - 1e-3);
    EXPECT_LE(reached.distance, 1.12 * arc + 5e-3);
    farthest = std::max(farthest, arc);
  }
  EXPECT_GT(farthest, 1.7);
}

TEST(GeodesicSearch, ForgetsTheCallBefore) {
  const mesh::SpaceTimeMesh mesh = synthetic::HexahedralSphere(12);
  const PackedLists cells = CellsAroundVertices(mesh, parallel::Arena(2));
  const PackedLists neighbors = VertexNeighbors(mesh, cells, parallel::Arena(1));
  const Points points = InEdgeUnits(mesh.vertices, 0.2);
  GeodesicSearch used(points, neighbors), fresh(points, neighbors);
  used.From(10, 4.0f);
  const auto again = used.From(200, 3.0f);
  const auto first = fresh.From(200, 3.0f);
  ASSERT_EQ(again.size(), first.size());
  for (size_t n = 0; n < first.size(); ++n) {
    EXPECT_EQ(again[n].vertex, first[n].vertex);
    EXPECT_EQ(again[n].distance, first[n].distance);
  }
}

}  // namespace
}  // namespace liquidblend::registration

#include "client/cli/files/mesh_stats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "tests/client/fake_server.h"

namespace liquidblend::cli {
namespace {

TEST(MeshStats, KnowsTheOctahedron) {
  const MeshStats stats = ComputeMeshStats(testing::MakeOctahedron(0.0, 2.0));
  EXPECT_TRUE(stats.closed());
  EXPECT_EQ(stats.num_components, 1);
  EXPECT_NEAR(stats.volume_m3, 4.0 / 3.0, 1e-6);
  EXPECT_NEAR(stats.area_m2, 2.0 * std::sqrt(3.0) * 2.0, 1e-6);
  EXPECT_NEAR(stats.mean_edge_length_m, std::sqrt(2.0), 1e-6);
  EXPECT_DOUBLE_EQ(stats.bounds.min.x, 1.0);
  EXPECT_DOUBLE_EQ(stats.bounds.max.z, 1.0);
}

TEST(MeshStats, CountsComponentsWithoutLooseVertices) {
  Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  const Mesh other = testing::MakeOctahedron(0.0, 5.0);
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const uint32_t v : other.triangles) mesh.triangles.push_back(v + 6);
  mesh.positions.insert(mesh.positions.end(), {9, 9, 9});
  EXPECT_EQ(ComputeMeshStats(mesh).num_components, 2);
}

TEST(MeshStats, SeesAHoleAndATurnedTriangle) {
  Mesh hole = testing::MakeOctahedron(0.0, 0.0);
  hole.triangles.resize(hole.triangles.size() - 3);
  EXPECT_EQ(ComputeMeshStats(hole).num_odd_edges, 3);
  EXPECT_FALSE(ComputeMeshStats(hole).closed());
  Mesh turned = testing::MakeOctahedron(0.0, 0.0);
  std::swap(turned.triangles[0], turned.triangles[1]);
  EXPECT_EQ(ComputeMeshStats(turned).num_odd_edges, 0);
  EXPECT_EQ(ComputeMeshStats(turned).num_misoriented_edges, 3);
}

TEST(MeshStats, AnEmptyMeshIsEmpty) {
  const MeshStats stats = ComputeMeshStats(Mesh());
  EXPECT_EQ(stats.num_components, 0);
  EXPECT_EQ(stats.mean_edge_length_m, 0.0);
}

}  // namespace
}  // namespace liquidblend::cli

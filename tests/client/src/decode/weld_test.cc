#include "client/src/decode/draco_mesh.h"

#include <gtest/gtest.h>

#include "client/cli/files/mesh_stats.h"
#include "liquidblend/decode.h"
#include "tests/client/fake_server.h"

namespace liquidblend {
namespace {

// Two tetrahedra that share the edge from vertex 0 to 1: four triangles meet there.
Mesh TwoTetrahedraAtOneEdge() {
  Mesh mesh;
  mesh.positions = {0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 1, 0, -1, 0, 0, -1, -1, 0};
  mesh.triangles = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2, 0, 1, 4, 0, 4, 5, 0, 5, 1, 1, 5, 4};
  return mesh;
}

TEST(WeldOpenEdges, ADecodedFrameIsClosedWhereFourTrianglesMeet) {
  const Mesh original = TwoTetrahedraAtOneEdge();
  ASSERT_TRUE(cli::ComputeMeshStats(original).closed());
  const auto mesh = DecodeMesh(testing::EncodeDraco(original, 14));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->num_triangles(), 8u);
  EXPECT_TRUE(cli::ComputeMeshStats(*mesh).closed());
}

TEST(WeldOpenEdges, JoinsPartsAlongOpenEdgesOnly) {
  // The tetrahedra each with vertices of their own, and the second one cut open at the edge.
  Mesh mesh = TwoTetrahedraAtOneEdge();
  mesh.positions.insert(mesh.positions.end(), {0, 0, 0, 0, 0, 1});
  mesh.triangles[12] = 6;  // triangle 4: 6 7 4
  mesh.triangles[13] = 7;
  EXPECT_FALSE(cli::ComputeMeshStats(mesh).closed());
  WeldOpenEdges(mesh);
  EXPECT_TRUE(cli::ComputeMeshStats(mesh).closed());
  EXPECT_EQ(mesh.num_vertices(), 6u);
}

TEST(WeldOpenEdges, LeavesClosedPartsAtOnePlaceApart) {
  Mesh mesh = TwoTetrahedraAtOneEdge();
  mesh.positions.insert(mesh.positions.end(), {0, 0, 0, 0, 0, 1});
  for (size_t c = 12; c < 24; ++c) {
    if (mesh.triangles[c] < 2) mesh.triangles[c] += 6;
  }
  const Mesh before = mesh;
  WeldOpenEdges(mesh);
  EXPECT_EQ(mesh.triangles, before.triangles);
  EXPECT_EQ(mesh.num_vertices(), 8u);
}

TEST(WeldOpenEdges, DropsATriangleWhoseCornersFallTogether) {
  Mesh mesh;
  mesh.positions = {0, 0, 0, 1, 0, 0, 0, 0, 0};
  mesh.triangles = {0, 1, 2};
  WeldOpenEdges(mesh);
  EXPECT_EQ(mesh.num_triangles(), 0u);
  EXPECT_EQ(mesh.num_vertices(), 0u);
}

TEST(WeldOpenEdges, NormalsAndVelocitiesStayWithTheirVertices) {
  Mesh mesh = TwoTetrahedraAtOneEdge();
  // Copies of the first edge's ends in front of all others: those that come later are dropped.
  mesh.positions.insert(mesh.positions.begin(), {0, 0, 0, 0, 0, 1});
  for (uint32_t& v : mesh.triangles) v += 2;
  mesh.triangles[12] = 0;
  mesh.triangles[13] = 1;
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    mesh.normals.push_back(mesh.positions[i] + 1);
    mesh.velocities.push_back(mesh.positions[i] + 2);
  }
  WeldOpenEdges(mesh);
  ASSERT_EQ(mesh.num_vertices(), 6u);
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  ASSERT_EQ(mesh.velocities.size(), mesh.positions.size());
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    EXPECT_EQ(mesh.normals[i], mesh.positions[i] + 1) << i;
    EXPECT_EQ(mesh.velocities[i], mesh.positions[i] + 2) << i;
  }
}

}  // namespace
}  // namespace liquidblend

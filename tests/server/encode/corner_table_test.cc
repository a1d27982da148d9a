#include "server/encode/corner_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "tests/synthetic/shapes.h"
#include "tests/synthetic/voxels.h"

namespace liquidblend::encode {
namespace {

using mesh::TriangleMesh;

// Triangles are neighbours both ways, over the same two vertices of the mesh in opposite order, and
// each vertex has one fan, of the size of its valence.
void ExpectManifold(const CornerTable& table, const TriangleMesh& mesh) {
  const auto mesh_vertex = [&](int32_t corner) {
    const int32_t v = table.VertexOf(corner);
    const auto num_of_mesh = static_cast<int32_t>(mesh.num_vertices());
    return v < num_of_mesh ? v : table.split_parents()[v - num_of_mesh];
  };
  std::vector<int32_t> fan_size(table.num_vertices(), 0);
  for (int32_t t = 0; t < table.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int32_t corner = 4 * t + k;
      const int32_t across = table.Opposite(corner);
      ASSERT_EQ(table.Opposite(across), corner);
      ASSERT_NE(CornerTable::TriangleOf(across), t);
      const int32_t next = CornerTable::Next(corner), previous = CornerTable::Previous(corner);
      ASSERT_EQ(mesh_vertex(next), mesh_vertex(CornerTable::Previous(across)));
      ASSERT_EQ(mesh_vertex(previous), mesh_vertex(CornerTable::Next(across)));
      ASSERT_EQ(table.VertexOf(next), table.VertexOf(CornerTable::Previous(across)));
      if (fan_size[table.VertexOf(corner)] > 0) continue;
      int32_t c = corner;
      do {
        ++fan_size[table.VertexOf(corner)];
        c = CornerTable::Next(table.RightOf(c));
        ASSERT_EQ(table.VertexOf(c), table.VertexOf(corner));
      } while (c != corner);
    }
  }
  EXPECT_EQ(fan_size, table.valences());
  EXPECT_EQ(std::count_if(fan_size.begin(), fan_size.end(), [](int32_t n) { return n > 0; }),
            table.num_used_vertices());
}

// Two cones of `num_sides` triangles, base to base.
TriangleMesh DoubleCone(int num_sides) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, num_sides + 2);
  mesh.triangles.resize(3, 2 * num_sides);
  for (int s = 0; s < num_sides; ++s) {
    const double angle = 2 * std::numbers::pi * s / num_sides;
    mesh.vertices.col(s) = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0).cast<float>();
    const int next = (s + 1) % num_sides;
    mesh.triangles.col(2 * s) = Eigen::Vector3i(s, next, num_sides);
    mesh.triangles.col(2 * s + 1) = Eigen::Vector3i(next, s, num_sides + 1);
  }
  mesh.vertices.rightCols(2) << 0, 0, 0, 0, 1, -1;
  return mesh;
}

TEST(CornerTable, OfAManifoldSplitsNothing) {
  CornerTable table;
  for (const TriangleMesh& mesh :
       {synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 3), synthetic::Box({0, 0, 0}, {1, 1, 1}),
        synthetic::Torus(Eigen::Vector3f::Zero(), 1.0, 0.4, 3, 3)}) {
    ASSERT_TRUE(table.Build(mesh));
    ExpectManifold(table, mesh);
    EXPECT_EQ(table.num_triangles(), mesh.num_triangles());
    EXPECT_EQ(table.num_vertices(), mesh.num_vertices());
    EXPECT_EQ(table.num_used_vertices(), mesh.num_vertices());
  }
}

TEST(CornerTable, TakesAnyValence) {
  CornerTable table;
  for (const int valence : {3, 7, 8, 9, 15, 16, 17, 24, 25, 1000, 100000}) {
    const TriangleMesh mesh = DoubleCone(valence);
    ASSERT_TRUE(table.Build(mesh)) << valence;
    ExpectManifold(table, mesh);
    EXPECT_EQ(table.valences()[valence], valence);
    EXPECT_EQ(table.num_vertices(), valence + 2);
  }
}

TEST(CornerTable, MakesManifoldsOfCubesThatTouchInEdgesAndCorners) {
  CornerTable table;
  for (uint64_t seed = 0; seed < 30; ++seed) {
    const TriangleMesh mesh = synthetic::VoxelSurface(synthetic::RandomVoxels(6, 0.4, seed));
    ASSERT_TRUE(table.Build(mesh)) << seed;
    ExpectManifold(table, mesh);
    EXPECT_EQ(table.num_triangles(), mesh.num_triangles());
    EXPECT_GT(table.split_parents().size(), 0U);
  }
}

TEST(CornerTable, LeavesOutTrianglesThatNameAVertexTwice) {
  TriangleMesh mesh = synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 1);
  const int64_t num_triangles = mesh.num_triangles();
  mesh.triangles.conservativeResize(Eigen::NoChange, num_triangles + 2);
  mesh.triangles.col(num_triangles) = mesh.triangles.col(3);
  mesh.triangles.col(num_triangles + 1) = Eigen::Vector3i(1, 2, 1);
  mesh.triangles.col(3) = Eigen::Vector3i(0, 5, 5);
  CornerTable table;
  ASSERT_TRUE(table.Build(mesh));
  ExpectManifold(table, mesh);
  EXPECT_EQ(table.num_triangles(), num_triangles);
}

TEST(CornerTable, RefusesWhatIsNotClosedAndOriented) {
  const TriangleMesh sphere = synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 2);
  CornerTable table;
  TriangleMesh open = sphere;
  open.triangles.conservativeResize(Eigen::NoChange, sphere.num_triangles() - 1);
  EXPECT_FALSE(table.Build(open));
  TriangleMesh turned = sphere;
  std::swap(turned.triangles(0, 7), turned.triangles(1, 7));
  EXPECT_FALSE(table.Build(turned));
  TriangleMesh doubled = sphere;
  doubled.triangles.col(7) = doubled.triangles.col(8);
  EXPECT_FALSE(table.Build(doubled));
  ASSERT_TRUE(table.Build(sphere));
  ExpectManifold(table, sphere);
}

TEST(CornerTable, OfNothingIsEmpty) {
  CornerTable table;
  TriangleMesh points;
  points.vertices = Eigen::Matrix3Xf::Zero(3, 4);
  ASSERT_TRUE(table.Build(points));
  EXPECT_EQ(table.num_triangles(), 0);
  EXPECT_EQ(table.num_used_vertices(), 0);
}

}  // namespace
}  // namespace liquidblend::encode

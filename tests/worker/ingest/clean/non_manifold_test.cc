// Frames whose surface touches itself, from what the readers see to what the stages behind get.
#include "worker/ingest/clean/non_manifold.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "tests/synthetic/shapes.h"
#include "tests/synthetic/voxels.h"
#include "worker/ingest/clean/clean.h"

namespace liquidblend::ingest {
namespace {

using mesh::TriangleMesh;
using synthetic::Box;
using testing::HasSubstr;

// Merges vertices that lie on one another, whatever that does.
TriangleMesh Welded(TriangleMesh mesh) {
  for (int& v : mesh.triangles.reshaped()) {
    int first = 0;
    while (mesh.vertices.col(first) != mesh.vertices.col(v)) ++first;
    v = first;
  }
  return mesh;
}

TriangleMesh WeldedBoxes(const std::vector<TriangleMesh>& boxes) {
  return Welded(synthetic::Join(boxes));
}

// Checks that every edge has two triangles and every vertex one fan.
void ExpectManifold(const TriangleMesh& mesh, const std::string& name) {
  EXPECT_TRUE(mesh::Validate(mesh).ok()) << name;
  EXPECT_TRUE(mesh::CheckClosed(mesh).closed()) << name;
  EXPECT_EQ(mesh::CheckClosed(mesh).num_non_manifold_edges, 0) << name;
  const absl::StatusOr<Pairing> pairing = FindNeighbours(mesh);
  ASSERT_TRUE(pairing.ok()) << name << pairing.status();
  TriangleMesh copy = mesh;
  EXPECT_EQ(SplitPinchedVertices(pairing->neighbours, copy), 0) << name;
}

CleanCounts CleanOrDie(TriangleMesh& mesh, const std::string& name) {
  const absl::StatusOr<CleanCounts> counts = Clean(mesh);
  EXPECT_TRUE(counts.ok()) << name << ": " << counts.status();
  if (!counts.ok()) return {};
  ExpectManifold(mesh, name);
  return *counts;
}

// Parts whose surface encloses liquid; the others are bubbles.
int NumBodies(const TriangleMesh& mesh) {
  std::vector<int> root(mesh.num_vertices());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& corners : mesh.triangles.colwise()) {
    root[find(corners[1])] = find(corners[0]);
    root[find(corners[2])] = find(corners[0]);
  }
  std::vector<double> volume(mesh.num_vertices(), 0.0);
  for (const auto& corners : mesh.triangles.colwise()) {
    Eigen::Matrix3d p;
    for (int k = 0; k < 3; ++k) p.col(k) = mesh.vertices.col(corners[k]).cast<double>();
    volume[find(corners[0])] += p.determinant() / 6;
  }
  int num_bodies = 0;
  for (const double of_part : volume) num_bodies += of_part > 1e-3;
  return num_bodies;
}

TEST(CleanNonManifold, TwoBoxesThatShareAnEdgeComeApart) {
  TriangleMesh mesh = WeldedBoxes({Box({0, 0, 0}, {1, 1, 1}), Box({1, 1, 0}, {2, 2, 1})});
  mesh.velocities = 2 * mesh.vertices;
  ASSERT_EQ(mesh::CheckClosed(mesh).num_non_manifold_edges, 1);
  const CleanCounts counts = CleanOrDie(mesh, "edge");
  EXPECT_EQ(counts.num_non_manifold, 1);
  EXPECT_EQ(counts.num_split, 2);
  EXPECT_EQ(counts.num_halved, 0);
  EXPECT_EQ(mesh.num_vertices(), 16);
  EXPECT_EQ(mesh::NumComponents(mesh), 2);
  EXPECT_EQ(NumBodies(mesh), 2);
  EXPECT_EQ(mesh.velocities, 2 * mesh.vertices);
  EXPECT_DOUBLE_EQ(mesh::Volume(mesh), 2.0);
}

TEST(CleanNonManifold, BoxesThatTouchInEdgesAndVerticesComeApart) {
  // The second shares an edge with the first and a vertex with the third.
  TriangleMesh mesh = WeldedBoxes(
      {Box({0, 0, 0}, {1, 1, 1}), Box({1, 1, 0}, {2, 2, 1}), Box({2, 2, 1}, {3, 3, 2})});
  const CleanCounts counts = CleanOrDie(mesh, "edge and vertex");
  EXPECT_EQ(counts.num_non_manifold, 1);
  EXPECT_EQ(counts.num_split, 3);
  EXPECT_EQ(NumBodies(mesh), 3);
  EXPECT_DOUBLE_EQ(mesh::Volume(mesh), 3.0);
}

TEST(CleanNonManifold, SixWedgesAroundAnEdgeComeApart) {
  constexpr int kNumWedges = 6;
  std::vector<TriangleMesh> wedges;
  for (int i = 0; i < kNumWedges; ++i) {
    const auto direction = [&](double share) {
      const double angle = 2 * 3.14159265 * (i + share) / kNumWedges;
      return Eigen::Vector3f(static_cast<float>(std::cos(angle)),
                             static_cast<float>(std::sin(angle)), 0.5f);
    };
    TriangleMesh wedge;
    wedge.vertices.resize(3, 4);
    wedge.vertices << Eigen::Vector3f(0, 0, 0), Eigen::Vector3f(0, 0, 1), direction(0),
        direction(0.5);
    wedge.triangles.resize(3, 4);
    wedge.triangles << 0, 0, 1, 0, 2, 1, 2, 3, 1, 3, 3, 2;
    wedges.push_back(mesh::Volume(wedge) > 0 ? wedge : synthetic::Flipped(wedge));
  }
  TriangleMesh mesh = WeldedBoxes(wedges);
  const double volume = mesh::Volume(mesh);
  const CleanCounts counts = CleanOrDie(mesh, "wedges");
  EXPECT_EQ(counts.num_non_manifold, 1);
  EXPECT_EQ(NumBodies(mesh), kNumWedges);
  EXPECT_EQ(mesh.num_vertices(), 4 * kNumWedges);
  EXPECT_NEAR(mesh::Volume(mesh), volume, 1e-12);
}

TEST(CleanNonManifold, ARingThatTouchesItselfGetsAVertexOnTheEdge) {
  // Two cubes touch in an edge, three join them below it and three above: the surface goes around
  // each end of the edge in a single fan.
  synthetic::Voxels voxels = {3, std::vector<bool>(27, false)};
  for (const auto& [x, y, z] : std::vector<std::array<int, 3>>{{0, 0, 1},
                                                               {1, 1, 1},
                                                               {0, 0, 0},
                                                               {1, 0, 0},
                                                               {1, 1, 0},
                                                               {0, 0, 2},
                                                               {1, 0, 2},
                                                               {1, 1, 2}}) {
    voxels.is_liquid[x + 3 * (y + 3 * z)] = true;
  }
  TriangleMesh mesh = synthetic::VoxelSurface(voxels);
  ASSERT_EQ(mesh::CheckClosed(mesh).num_non_manifold_edges, 1);
  const CleanCounts counts = CleanOrDie(mesh, "ring");
  EXPECT_EQ(counts.num_non_manifold, 1);
  EXPECT_EQ(counts.num_halved, 1);
  EXPECT_EQ(NumBodies(mesh), 1);
  EXPECT_DOUBLE_EQ(mesh::Volume(mesh), 8.0);
}

TEST(CleanNonManifold, BoxesThatShareAWallBecomeOne) {
  for (const int cells : {1, 3}) {
    TriangleMesh mesh =
        WeldedBoxes({Box({0, 0, 0}, {1, 1, 1}, cells), Box({1, 0, 0}, {2, 1, 1}, cells)});
    const CleanCounts counts = CleanOrDie(mesh, "wall");
    EXPECT_NEAR(mesh::Volume(mesh), 2.0, 1e-6);
    EXPECT_EQ(counts.num_non_manifold, 0);
    EXPECT_EQ(counts.num_back_to_back, 4 * cells * cells);
    EXPECT_EQ(NumBodies(mesh), 1);
  }
}

// Off the axes, so that positions and angles are rounded.
Eigen::Matrix3f Turned(float angle) {
  return Eigen::AngleAxisf(angle, Eigen::Vector3f(1, 2, 3).normalized()).toRotationMatrix();
}

TEST(CleanNonManifold, RandomVoxelsBecomeManifoldsOfTheSamePartsAndVolume) {
  int64_t num_non_manifold = 0;
  int64_t num_halved = 0;
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    const std::string name = "seed " + std::to_string(seed);
    const int num_per_side = 2 + static_cast<int>(seed % 5);
    const double share = 0.15 + 0.1 * static_cast<double>(seed % 8);
    const synthetic::Voxels voxels = synthetic::RandomVoxels(num_per_side, share, seed);
    TriangleMesh mesh = synthetic::VoxelSurface(voxels);
    const double volume = mesh::Volume(mesh);
    if (volume == 0) continue;
    if (seed % 2 == 0) mesh.vertices = Turned(static_cast<float>(seed)) * mesh.vertices;
    const CleanCounts counts = CleanOrDie(mesh, name);
    EXPECT_NEAR(mesh::Volume(mesh) / volume, 1.0, 1e-6) << name;
    EXPECT_EQ(NumBodies(mesh), synthetic::NumParts(voxels)) << name;
    num_non_manifold += counts.num_non_manifold;
    num_halved += counts.num_halved;
  }
  EXPECT_GT(num_non_manifold, 1000);
  EXPECT_GT(num_halved, 100);
}

}  // namespace
}  // namespace liquidblend::ingest

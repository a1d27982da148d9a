#include "worker/ingest/clean/slivers.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <random>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "tests/synthetic/shapes.h"
#include "worker/ingest/clean/check.h"
#include "worker/ingest/clean/clean.h"

namespace liquidblend::ingest {
namespace {

using Eigen::Vector3f;
using mesh::TriangleMesh;

// Adds a vertex at `position` inside of triangle t, which becomes three.
void SplitTriangle(TriangleMesh& mesh, int t, const Vector3f& position) {
  const auto v = static_cast<int>(mesh.num_vertices());
  const auto num = static_cast<int>(mesh.num_triangles());
  const Eigen::Vector3i c = mesh.triangles.col(t);
  mesh.vertices.conservativeResize(3, v + 1);
  mesh.vertices.col(v) = position;
  mesh.triangles.conservativeResize(3, num + 2);
  mesh.triangles.col(t) << c[0], c[1], v;
  mesh.triangles.col(num) << c[1], c[2], v;
  mesh.triangles.col(num + 1) << c[2], c[0], v;
}

Vector3f Corner(const TriangleMesh& mesh, int t, int k) {
  return mesh.vertices.col(mesh.triangles(k, t));
}

SliverCounts Remove(TriangleMesh& mesh) {
  const absl::StatusOr<Pairing> pairing = FindNeighbours(mesh);
  EXPECT_TRUE(pairing.ok()) << pairing.status();
  return pairing.ok() ? RemoveSlivers(pairing->neighbours, mesh) : SliverCounts();
}

TEST(RemoveSlivers, LeavesSoundMeshesAlone) {
  const TriangleMesh ball = synthetic::Icosphere({0, 0, 0}, 1.0, 2);
  TriangleMesh mesh = ball;
  const SliverCounts counts = Remove(mesh);
  EXPECT_EQ(counts.num_removed + counts.num_left + counts.num_specks, 0);
  EXPECT_EQ(mesh.triangles, ball.triangles);
}

TEST(RemoveSlivers, CollapsesTheShortSideOfNeedles) {
  TriangleMesh mesh = synthetic::Icosphere({0, 0, 0}, 1.0, 2);
  const double volume = mesh::Volume(mesh);
  // Next to a corner: two needles, one sound triangle.
  SplitTriangle(mesh, 5,
                0.999f * Corner(mesh, 5, 0) + 0.0005f * (Corner(mesh, 5, 1) + Corner(mesh, 5, 2)));
  const SliverCounts counts = Remove(mesh);
  EXPECT_EQ(counts.num_removed, 2);
  EXPECT_EQ(counts.num_left, 0);
  EXPECT_EQ(mesh.num_triangles(), 320);
  EXPECT_TRUE(mesh::CheckClosed(mesh).closed());
  EXPECT_NEAR(mesh::Volume(mesh), volume, 1e-4);
}

TEST(RemoveSlivers, FlipsTheLongSideOfCaps) {
  TriangleMesh mesh = synthetic::Icosphere({0, 0, 0}, 1.0, 1);
  const double volume = mesh::Volume(mesh);
  // On the middle of a side: one triangle without area.
  SplitTriangle(mesh, 3, 0.5f * (Corner(mesh, 3, 0) + Corner(mesh, 3, 1)));
  const SliverCounts counts = Remove(mesh);
  EXPECT_EQ(counts.num_removed, 1);
  EXPECT_EQ(counts.num_left, 0);
  EXPECT_EQ(mesh.num_triangles(), 82);
  EXPECT_TRUE(mesh::CheckClosed(mesh).closed());
  EXPECT_NEAR(mesh::Volume(mesh), volume, 1e-6);
}

TEST(RemoveSlivers, DropsPartsWithoutExtentOrVolume) {
  TriangleMesh flap;  // two triangles back to back
  flap.vertices = synthetic::Box({3, 3, 3}, {4, 4, 4}).vertices.leftCols(3);
  flap.triangles.resize(3, 2);
  flap.triangles << 0, 0, 1, 2, 2, 1;
  TriangleMesh mesh = synthetic::Join(std::array{synthetic::Icosphere({0, 0, 0}, 1.0, 2), flap,
                                                 synthetic::Icosphere({5, 0, 0}, 1e-5, 0),
                                                 synthetic::Icosphere({2, 0, 0}, 0.0, 0)});
  const SliverCounts counts = Remove(mesh);
  EXPECT_EQ(counts.num_specks, 3);
  EXPECT_EQ(mesh.num_triangles(), 320);
}

TEST(RemoveSlivers, KeepsTopologyWhereACollapseWouldChangeIt) {
  // A torus so thin that collapsing around its tube would cut it.
  TriangleMesh ring = synthetic::Torus({0, 0, 0}, 1.0, 0.001, 12, 3);
  const SliverCounts counts = Remove(ring);
  EXPECT_GT(counts.num_left, 0);
  EXPECT_TRUE(mesh::CheckClosed(ring).closed());
  TriangleMesh compact = ring;
  ASSERT_TRUE(Clean(compact).ok());
  // Euler's characteristic of genus 1: V - T / 2 = 0.
  EXPECT_EQ(compact.num_vertices() - compact.num_triangles() / 2, 0);
}

// Random splits close to corners, sides and anywhere make chains of needles and caps.
TEST(RemoveSlivers, KeepsRandomMeshesClosedAndInPlace) {
  for (int seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    TriangleMesh mesh = synthetic::Join(std::array{synthetic::Icosphere({0, 0, 0}, 1.0, 2),
                                                   synthetic::Box({2, 0, 0}, {3, 1, 1}, 3)});
    const double volume = mesh::Volume(mesh);
    for (int i = 0; i < 300; ++i) {
      const int t = static_cast<int>(random() % mesh.num_triangles());
      Vector3f weight(uniform(random), uniform(random), uniform(random));
      if (i % 3 == 0) weight[random() % 3] *= 1e-4f;
      if (i % 3 == 1) weight[random() % 3] *= 1e4f;
      if (i % 50 == 0) weight = Vector3f(1, 0, 0);
      weight /= weight.sum();
      SplitTriangle(mesh, t,
                    weight[0] * Corner(mesh, t, 0) + weight[1] * Corner(mesh, t, 1) +
                        weight[2] * Corner(mesh, t, 2));
    }
    TriangleMesh cleaned = mesh;
    const absl::StatusOr<CleanCounts> counts = Clean(cleaned);
    ASSERT_TRUE(counts.ok()) << counts.status();
    EXPECT_GT(counts->num_slivers, 100);
    EXPECT_LT(counts->num_slivers_left, 20);
    EXPECT_TRUE(mesh::CheckClosed(cleaned).closed());
    EXPECT_TRUE(mesh::Validate(cleaned).ok());
    EXPECT_TRUE(FindNeighbours(cleaned).ok());
    EXPECT_EQ(mesh::NumComponents(cleaned), 2);
    EXPECT_EQ(cleaned.num_vertices() - cleaned.num_triangles() / 2, 4);  // two spheres
    EXPECT_NEAR(mesh::Volume(cleaned), volume, 0.01 * volume);
  }
}

}  // namespace
}  // namespace liquidblend::ingest

#include "worker/spacetime/sheets/thin_sheets.h"

#include <gmock/gmock.h>

#include <cmath>
#include <span>

#include "tests/synthetic/shapes.h"
#include "worker/spacetime/build.h"

namespace liquidblend::spacetime::thin_sheets_test {
namespace {

using ::testing::Each;

constexpr int kSide = 9;

// Two square layers of vertices, one above the other: the lower one looks along `lower_normal_z`,
// the upper one the other way.
struct Layers {
  float distance_m = 0.5F;
  float lower_normal_z = -1.0F;
  float upper_time = 0.0F;
};

mesh::SpaceTimeMesh MeshOf(const Layers& layers) {
  constexpr int kNumInLayer = kSide * kSide;
  mesh::SpaceTimeMesh mesh;
  mesh.num_frames = 3;
  mesh.edge_length_m = 1.0;
  mesh.vertices.resize(4, 2 * kNumInLayer);
  mesh.normals = Eigen::Matrix4Xf::Zero(4, 2 * kNumInLayer);
  for (int v = 0; v < 2 * kNumInLayer; ++v) {
    const bool is_upper = v >= kNumInLayer;
    mesh.vertices.col(v) << static_cast<float>(v % kSide), static_cast<float>(v / kSide % kSide),
        is_upper ? layers.distance_m : 0.0F, is_upper ? layers.upper_time : 0.0F;
    mesh.normals(2, v) = is_upper ? -layers.lower_normal_z : layers.lower_normal_z;
  }
  return mesh;
}

std::vector<char> Flags(mesh::SpaceTimeMesh mesh, double thickness_m) {
  FlagThinSheets(thickness_m, parallel::Arena(2), mesh);
  return mesh.thin;
}

TEST(FlagThinSheets, BothSidesOfASheetUpToItsThickness) {
  EXPECT_THAT(Flags(MeshOf({}), 0.6), Each(1));
  EXPECT_THAT(Flags(MeshOf({}), 0.4), Each(0));
}

TEST(FlagThinSheets, AGapBetweenTwoBodiesIsNoSheet) {
  EXPECT_THAT(Flags(MeshOf({.lower_normal_z = 1.0F}), 0.6), Each(0));
}

TEST(FlagThinSheets, AnotherFrameOfTimeDoesNotCount) {
  EXPECT_THAT(Flags(MeshOf({.upper_time = 1.5F}), 0.6), Each(0));
}

TEST(FlagThinSheets, MemoryDoesNotFollowTheDuration) {
  mesh::SpaceTimeMesh mesh = MeshOf({});
  mesh.num_frames = 2'000'000'000;  // a list a frame would be 48 GB
  mesh.vertices.rightCols(1)(3, 0) = 1e9F;
  std::vector<char> expected(mesh.num_vertices(), 1);
  expected.back() = expected[kSide * kSide - 1] = 0;  // the moved one and its counterpart
  EXPECT_EQ(Flags(mesh, 0.6), expected);
}

TEST(FlagThinSheets, DropletsAreNone) {
  mesh::SpaceTimeMesh mesh = MeshOf({});
  mesh.rigid_pieces.push_back({0, 2 * kSide * kSide, 0});
  EXPECT_THAT(Flags(std::move(mesh), 0.6), Each(0));
}

TEST(FlagThinSheets, GrowsByTwoRings) {
  // One pair of vertices that oppose each other, and a row of tetrahedra that leads away.
  mesh::SpaceTimeMesh mesh;
  mesh.num_frames = 1;
  mesh.edge_length_m = 1.0;
  constexpr int kNumInRow = 14;
  mesh.vertices = Eigen::Matrix4Xf::Zero(4, kNumInRow + 1);
  mesh.normals = Eigen::Vector4f(0, 0, 1, 0).replicate(1, kNumInRow + 1);
  for (int v = 0; v < kNumInRow; ++v) mesh.vertices(0, v) = 2.0F * static_cast<float>(v);
  mesh.vertices(2, kNumInRow) = -0.1F;
  mesh.normals(2, kNumInRow) = -1.0F;
  for (int v = 0; v + 3 < kNumInRow; v += 3) mesh.tetrahedra.push_back({v, v + 1, v + 2, v + 3});
  const std::vector<char> flags = Flags(mesh, 0.5);
  EXPECT_THAT(std::span(flags).first(7), Each(1));
  EXPECT_THAT(std::span(flags).subspan(7, kNumInRow - 7), Each(0));
}

TEST(FlagThinSheets, BuildFlagsASlabAndNotABlock) {
  for (const float height_m : {0.05F, 2.0F}) {
    mesh::Animation animation;
    mesh::TriangleMesh box = synthetic::Box({-1, -1, 0}, {1, 1, height_m}, 20);
    box.velocities = Eigen::Matrix3Xf::Zero(3, box.num_vertices());
    animation.frames.assign(3, box);
    for (const Connectivity connectivity : {Connectivity::kRebuilt, Connectivity::kTracked}) {
      BuildOptions options;
      options.connectivity = connectivity;
      const auto mesh = Build(animation, options, parallel::Arena(2));
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      for (int64_t v = 0; v < mesh->num_vertices(); ++v) {
        if (std::abs(mesh->normals(2, v)) < 0.9F) continue;  // the narrow sides of the slab
        ASSERT_EQ(mesh->thin[v] != 0, height_m < 1)
            << "vertex " << v << ", connectivity " << static_cast<int>(connectivity);
      }
    }
  }
}

}  // namespace
}  // namespace liquidblend::spacetime::thin_sheets_test

#include "client/cli/export/voxels.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/client/fake_server.h"

namespace liquidblend::cli {
namespace {

Mesh MakeTriangle(const std::vector<float>& positions) {
  Mesh mesh;
  mesh.positions = positions;
  mesh.triangles = {0, 1, 2};
  return mesh;
}

bool IsRefused(const Mesh& mesh, double voxel_size_m, const std::string& why) {
  const absl::Status status = CheckVoxels(mesh, voxel_size_m);
  return absl::IsInvalidArgument(status) &&
         std::string(status.message()).find(why) != std::string::npos;
}

TEST(CheckVoxels, RefusesALargeArea) {
  const Mesh octahedron = testing::MakeOctahedron(0.0, 0.0);  // of 6.9 square metres
  EXPECT_TRUE(CheckVoxels(octahedron, 3e-4).ok());
  EXPECT_TRUE(IsRefused(octahedron, 2e-4, "square metres"));
}

TEST(CheckVoxels, RefusesLongSlivers) {
  const Mesh sliver = MakeTriangle({0, 0, 0, 1e6, 0, 0, 5e5, 1e-6F, 0});
  EXPECT_TRUE(IsRefused(sliver, 0.01, "more than 24 GB"));
  EXPECT_TRUE(CheckVoxels(sliver, 1.0).ok());
  // Points on a line have no area at all.
  EXPECT_TRUE(IsRefused(MakeTriangle({0, 0, 0, 1e6, 0, 0, 5e5, 0, 0}), 0.01, "more than 24 GB"));
  // In any direction, and whichever side is the long one.
  EXPECT_TRUE(
      IsRefused(MakeTriangle({0, 0, 0, 1e-3F, 0, 0, -7e5, 5e5, 3e5}), 0.01, "more than 24 GB"));
}

// Each has its own nodes of the tree, though a million of them have hardly an area.
TEST(CheckVoxels, RefusesScatteredTriangles) {
  Mesh mesh;
  for (uint32_t k = 0; k < 30000; ++k) {
    const auto x = static_cast<float>(5000 * (k % 200)), y = static_cast<float>(5000 * (k / 200));
    mesh.positions.insert(mesh.positions.end(), {x, y, 0, x + 1, y, 0, x, y + 1, 0});
    mesh.triangles.insert(mesh.triangles.end(), {3 * k, 3 * k + 1, 3 * k + 2});
  }
  EXPECT_TRUE(IsRefused(mesh, 1.0, "more than 24 GB"));
  EXPECT_TRUE(CheckVoxels(mesh, 1000.0).ok());
}

// Those of one place share the nodes, small or large.
TEST(CheckVoxels, TakesMillionsOfOrdinaryTriangles) {
  Mesh mesh = MakeTriangle({0, 0, 0, 0.01F, 0, 0, 0.005F, 0.0087F, 0});
  mesh.triangles.clear();
  for (int k = 0; k < 4'000'000; ++k) {
    mesh.triangles.insert(mesh.triangles.end(), {0, 1, 2});
  }
  EXPECT_TRUE(CheckVoxels(mesh, 0.01).ok());
  EXPECT_TRUE(CheckVoxels(mesh, 0.003).ok());
  const Mesh octahedron = testing::MakeOctahedron(0.0, 0.0);  // 0.8e8 voxels along the surface
  EXPECT_TRUE(CheckVoxels(octahedron, 3e-4).ok());
}

TEST(CheckVoxels, RefusesCoordinatesBeyondWholeNumbers) {
  const float far = 3e7F;
  const Mesh mesh = MakeTriangle({far, 0, 0, far, 10, 0, far, 0, 10});
  EXPECT_TRUE(CheckVoxels(mesh, 0.1).ok());
  EXPECT_TRUE(IsRefused(mesh, 0.01, "metres from the origin"));
  EXPECT_TRUE(IsRefused(MakeTriangle({0, -far, 0, 1, -far, 0, 0, -far, 1}), 0.01,
                        "metres from the origin"));
  EXPECT_TRUE(IsRefused(mesh, 1e-300, "metres from the origin"));
}

TEST(CheckVoxels, AFrameWithoutLiquidHasNone) { EXPECT_TRUE(CheckVoxels(Mesh(), 1.0).ok()); }

}  // namespace
}  // namespace liquidblend::cli

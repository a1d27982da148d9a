#include "worker/spacetime/field/inside.h"

#include <gtest/gtest.h>

#include "tests/worker/spacetime/field/grid_testing.h"

namespace liquidblend::spacetime::inside_test {
namespace {

constexpr int kSide = 70;  // more than one word of bits per row

int CountInside(const Grid& grid, const InsideBits& inside) {
  int count = 0;
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      ForEachBit(inside.Row(j, k), grid.words_per_row(), [&](int) { ++count; });
    }
  }
  return count;
}

TEST(ComputeInside, AgreesWithTheDistanceToASphere) {
  const Grid grid = CubeGrid(kSide);
  const Eigen::Vector3f centre(33.3f, 34.1f, 35.7f);
  const InsideBits inside = ComputeInside(grid, InGrid(synthetic::Icosphere(centre, 20.0, 5)));
  const float chord = 0.05f;  // how far the polyhedron may lie within the sphere
  for (int k = 0; k < kSide; ++k) {
    for (int j = 0; j < kSide; ++j) {
      for (int i = 0; i < kSide; ++i) {
        const float distance = (PointAt(i, j, k) - centre).norm();
        if (distance < 20.0f - chord) {
          EXPECT_TRUE(inside.At(i, j, k)) << i << ' ' << j << ' ' << k;
        } else if (distance > 20.0f) {
          EXPECT_FALSE(inside.At(i, j, k)) << i << ' ' << j << ' ' << k;
        }
      }
    }
  }
}

TEST(ComputeInside, KeepsABubbleOutside) {
  const Grid grid = CubeGrid(kSide);
  const Eigen::Vector3f centre(35, 35, 35);
  const InsideBits inside =
      ComputeInside(grid, InGrid(synthetic::BallWithBubble(centre, 20.0, 8.0, 4)));
  EXPECT_FALSE(inside.At(35, 35, 35));
  EXPECT_TRUE(inside.At(35, 35, 35 + 14));
  EXPECT_FALSE(inside.At(35, 35, 35 + 22));
}

TEST(ComputeInside, OverlappingPartsStayInside) {
  const Grid grid = CubeGrid(kSide);
  const std::vector<mesh::TriangleMesh> parts = {synthetic::Icosphere({30, 35, 35}, 10.0, 4),
                                                 synthetic::Icosphere({38, 35, 35}, 10.0, 4)};
  const InsideBits inside = ComputeInside(grid, InGrid(synthetic::Join(parts)));
  EXPECT_TRUE(inside.At(34, 35, 35));
}

TEST(ComputeInside, CountsABoxWhoseFacesLieInGridPlanes) {
  const Grid grid = CubeGrid(kSide);
  const InsideBits inside =
      ComputeInside(grid, InGrid(synthetic::Box({10, 10, 10}, {20, 20, 20}, 5)));
  // Each axis holds 10 or 11 points, by how ties at the faces fall; never a leak along a row.
  EXPECT_GE(CountInside(grid, inside), 10 * 10 * 10);
  EXPECT_LE(CountInside(grid, inside), 11 * 11 * 11);
  EXPECT_FALSE(inside.At(25, 15, 15));
  EXPECT_FALSE(inside.At(5, 15, 15));
}

}  // namespace
}  // namespace liquidblend::spacetime::inside_test

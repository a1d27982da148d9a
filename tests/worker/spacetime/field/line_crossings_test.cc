#include "worker/spacetime/field/line_crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "tests/worker/spacetime/field/grid_testing.h"
#include "worker/spacetime/field/inside.h"

namespace liquidblend::spacetime::line_crossings_test {
namespace {

constexpr int kSide = 32;

std::vector<Crossing> CrossingsAlong(const Grid& grid, const GridSurface& surface, int axis) {
  std::vector<Crossing> crossings;
  for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
    CrossLines(surface, t, GridLines(grid, axis), NthLineShift(0), crossings);
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return std::tie(a.line, a.at) < std::tie(b.line, b.at);
  });
  return crossings;
}

TEST(CrossLines, LinesAlongAllAxesHaveTheSamePointsInside) {
  const Grid grid = CubeGrid(kSide);
  const GridSurface torus = InGrid(synthetic::Torus({15.3f, 15.7f, 15.1f}, 8.0, 3.0, 60, 30));
  const InsideBits inside = ComputeInside(grid, torus);
  for (int axis = 0; axis < 3; ++axis) {
    const GridLines lines(grid, axis);
    int num_inside = 0;
    const std::vector<Crossing> crossings = CrossingsAlong(grid, torus, axis);
    ASSERT_EQ(crossings.size() % 2, 0U);
    for (size_t n = 0; n < crossings.size(); n += 2) {
      const Crossing &in = crossings[n], &out = crossings[n + 1];
      ASSERT_EQ(in.line, out.line);
      EXPECT_EQ(in.winding, 1);
      EXPECT_EQ(out.winding, -1);
      for (int a = static_cast<int>(std::ceil(in.at)); a <= out.at; ++a, ++num_inside) {
        std::array<int, 3> point;
        point[axis] = a;
        point[lines.u] = static_cast<int>(in.line % lines.num_u);
        point[lines.v] = static_cast<int>(in.line / lines.num_u);
        EXPECT_TRUE(inside.At(point[0], point[1], point[2]));
      }
    }
    EXPECT_GT(num_inside, 1300);  // of a volume of 1421 (2 pi^2 8 3^2)
    EXPECT_LT(num_inside, 1500);
  }
}

TEST(CrossLines, ALineMeetsATriangleWhereItShould) {
  GridSurface surface;
  surface.vertices.resize(3, 3);
  surface.vertices << 2, 6, 2, 3, 3, 7, 1, 3, 3;  // z = 1 + (x - 2) / 2 + (y - 3) / 2
  surface.triangles = Eigen::Vector3i(0, 1, 2);
  std::vector<Crossing> crossings;
  const GridLines lines(CubeGrid(8), 2);
  CrossLine(surface, 0, lines, lines.Line(3, 4), {0, 0}, crossings);
  ASSERT_EQ(crossings.size(), 1U);
  EXPECT_NEAR(crossings[0].at, 2.0, 1e-6);
  EXPECT_EQ(crossings[0].winding, -1);  // it faces +z: the liquid ends there
  CrossLine(surface, 0, lines, lines.Line(6, 6), {0, 0}, crossings);
  EXPECT_EQ(crossings.size(), 1U);
}

}  // namespace
}  // namespace liquidblend::spacetime::line_crossings_test

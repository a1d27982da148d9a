#include "worker/registration/axis_rays.h"

#include <gtest/gtest.h>

#include "tests/synthetic/shapes.h"

namespace liquidblend::registration {
namespace {

TEST(AxisRays, ThroughVerticesAndEdgesCrossOnce) {
  // All rays run through the corners and along the diagonals of a box of whole numbers.
  const mesh::TriangleMesh box = synthetic::Box({0, 0, 0}, {4, 4, 4}, 4);
  for (const int axis : {0, 1, 2}) {
    RayGrid grid;
    grid.axis = axis;
    grid.first_m = {-1, -1};
    grid.counts = {7, 7};
    const AxisRays rays(box, grid);
    int num_hits = 0;
    for (int v = 0; v < 7; ++v) {
      for (int u = 0; u < 7; ++u) {
        const auto crossings = rays.Crossings(u, v);
        if (crossings.empty()) continue;
        ++num_hits;
        ASSERT_EQ(crossings.size(), 2U) << axis << " " << u << " " << v;
        EXPECT_EQ(crossings[0].depth_m, 0);
        EXPECT_EQ(crossings[0].step, 1);
        EXPECT_EQ(crossings[1].depth_m, 4);
        EXPECT_EQ(rays.Winding(u, v, 2.0), 1);
        EXPECT_EQ(rays.Winding(u, v, 5.0), 0);
      }
    }
    EXPECT_EQ(num_hits, 16) << axis;  // of the 5 x 5 on the box; two sides of its rim are beside it
  }
}

}  // namespace
}  // namespace liquidblend::registration

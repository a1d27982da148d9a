#include "worker/registration/surface/axis_rays.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

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

mesh::TriangleMesh InsideOut(mesh::TriangleMesh surface) {
  surface.triangles.row(0).swap(surface.triangles.row(1));
  return surface;
}

TEST(AxisRays, KnowTheTrianglesTheyCross) {
  const mesh::TriangleMesh ball = synthetic::Icosphere({0.1f, 0.2f, 0.3f}, 1.0, 3);
  const RayGrid grid = RaysThrough(ball, 0, 0.2, 0.4);
  const AxisRays rays(ball, grid);
  int num_crossings = 0;
  for (int v = 0; v < grid.counts[1]; ++v) {
    for (int u = 0; u < grid.counts[0]; ++u) {
      for (const Crossing& crossing : rays.Crossings(u, v)) {
        ++num_crossings;
        const Eigen::Vector3i corners = ball.triangles.col(crossing.triangle);
        Eigen::Matrix3d p;
        for (int k = 0; k < 3; ++k) p.col(k) = ball.vertices.col(corners[k]).cast<double>();
        const Eigen::Vector3d normal = (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0));
        const Eigen::Vector3d at(crossing.depth_m, grid.first_m[0] + u * grid.spacing_m,
                                 grid.first_m[1] + v * grid.spacing_m);
        EXPECT_LT(std::abs(normal.normalized().dot(at - p.col(0))), 1e-5);  // rounding
        EXPECT_LT((at - p.rowwise().mean()).norm(), 0.2);                   // a triangle's size
        EXPECT_EQ(crossing.step, normal.x() < 0 ? 1 : -1);
      }
    }
  }
  EXPECT_GT(num_crossings, 100);
}

TEST(RaysThrough, AreNoMoreThanAThousandAlongASide) {
  const mesh::TriangleMesh box = synthetic::Box({0, 0, 0}, {1e6f, 1, 1}, 1);
  EXPECT_LE(RaysThrough(box, 2, 1e-3, 0.4).counts[0], 1025);
  EXPECT_DOUBLE_EQ(RaysThrough(synthetic::Box({0, 0, 0}, {4, 4, 4}, 1), 2, 0.5, 0.4).spacing_m,
                   0.5);
}

TEST(FindInvertedSpans, AreWhereRaysLeaveBeforeTheyEnter) {
  const auto spans = [](const std::vector<mesh::TriangleMesh>& parts) {
    const mesh::TriangleMesh surface = synthetic::Join(parts);
    return FindInvertedSpans(surface, RaysThrough(surface, 2, 1.0, 0.4));
  };
  const auto box = [](float low, float high) {
    return synthetic::Box({0, 0, low}, {4, 4, high}, 1);
  };
  EXPECT_TRUE(spans({box(0, 4)}).empty());
  EXPECT_TRUE(spans({box(0, 4), InsideOut(box(1, 2))}).empty()) << "a bubble";
  const auto alone = spans({box(0, 4), InsideOut(box(5, 5.5f))});
  ASSERT_EQ(alone.size(), 16U);  // 4 x 4 of the rays go through the box
  for (const InvertedSpan& span : alone) {
    EXPECT_FLOAT_EQ(span.leaves.depth_m, 5);
    EXPECT_FLOAT_EQ(span.enters.depth_m, 5.5f);
  }
  // One within the other: -1, -2, -1.
  const auto nested = spans({InsideOut(box(0, 4)), InsideOut(box(1, 2))});
  ASSERT_EQ(nested.size() % 2, 0U);
  EXPECT_FLOAT_EQ(nested[0].leaves.depth_m, 1);
  EXPECT_FLOAT_EQ(nested[0].enters.depth_m, 2);
  EXPECT_FLOAT_EQ(nested[1].leaves.depth_m, 0);
  EXPECT_FLOAT_EQ(nested[1].enters.depth_m, 4);
}

}  // namespace
}  // namespace liquidblend::registration

#include "worker/registration/features/container_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/worker/registration/drops_testing.h"

namespace liquidblend::registration {
namespace {

// Whether a point is so near to a side of the pool across each axis, in edges.
std::array<bool, 3> IsNearSides(const Surface& surface, const Eigen::Vector4f& point, float reach) {
  const Eigen::Vector4f low = surface.points.rowwise().minCoeff();
  Eigen::Vector4f high = surface.points.rowwise().maxCoeff();
  high[2] = 0;  // the top of the pool
  std::array<bool, 3> near;
  for (const int axis : {0, 1, 2}) {
    near[axis] = std::min(point[axis] - low[axis], high[axis] - point[axis]) < reach;
  }
  return near;
}

TEST(ContainerEdges, AreHeldAcrossTheirWallsAndFreeAlongTheEdge) {
  const TestSurface left(Scene({DropAt(-0.5, 0.8)})), right(Scene({DropAt(0.5, 0.8)}));
  const HeldVertices held =
      FindContainerEdges(left.surface, right.surface, {}, left.mesh.edge_length_m);
  EXPECT_GT(held.size(), 500u);
  int num_free_along = 0;
  for (const auto& [v, projection] : held) {
    // Contacts of an edge are within 4 edges of each other.
    const Eigen::Vector4f point = left.surface.points.col(v);
    const auto near = IsNearSides(left.surface, point, 4.5f);
    EXPECT_GE(std::count(near.begin(), near.end(), true), 2) << v;
    const auto may_be_corner = IsNearSides(left.surface, point, 6);
    for (const int axis : {0, 1, 2}) {
      if (may_be_corner[axis]) continue;
      EXPECT_LT(projection(axis, axis), 0.1f) << v << " along axis " << axis;
      EXPECT_GT(projection.trace(), 1.9f) << v;
      ++num_free_along;
    }
  }
  EXPECT_GT(num_free_along, 300);
}

TEST(ContainerEdges, CornersAreHeldInAllDirections) {
  const TestSurface pool(Scene({}));
  const HeldVertices held = FindContainerEdges(pool.surface, pool.surface, {}, 1);
  const Eigen::Vector4f low = pool.surface.points.rowwise().minCoeff();
  int num_at_corners = 0;
  for (const auto& [v, projection] : held) {
    if ((pool.surface.points.col(v) - low).head<3>().norm() > 2) continue;
    EXPECT_GT(projection.trace(), 2.9f) << v;
    ++num_at_corners;
  }
  EXPECT_GT(num_at_corners, 5);
}

TEST(ContainerEdges, AnEdgeThatOnlyOneHasIsNone) {
  const TestSurface wide(Scene({}, 1.2)), narrow(Scene({}, 0.8));
  const double edge_m = wide.mesh.edge_length_m;
  const HeldVertices held = FindContainerEdges(wide.surface, narrow.surface, {}, edge_m);
  EXPECT_GT(held.size(), 100u) << "those along the length";
  for (const auto& [v, projection] : held) {
    EXPECT_LT(edge_m * std::abs(wide.surface.points(0, v)), 0.8 + 2 * edge_m) << v;
    EXPECT_LT(projection(0, 0), 0.1f)
        << v << ": the narrow one's ends are no walls of the wide one";
  }
}

TEST(ContainerEdges, NearAUsersCorrespondenceNothingIsHeld) {
  const TestSurface pool(Scene({}));
  const double edge_m = pool.mesh.edge_length_m;
  const Eigen::Vector4f corner = pool.surface.points.rowwise().minCoeff();
  Correspondence user;
  user.source.head<3>() = edge_m * corner.head<3>().cast<double>();
  const HeldVertices all = FindContainerEdges(pool.surface, pool.surface, {}, edge_m);
  const HeldVertices held = FindContainerEdges(pool.surface, pool.surface, {user}, edge_m);
  EXPECT_LT(held.size(), all.size());
  EXPECT_FALSE(held.empty());
  for (const auto& [v, projection] : held) {
    EXPECT_GE((pool.surface.points.col(v) - corner).head<3>().norm(), 10) << v;
  }
}

}  // namespace
}  // namespace liquidblend::registration

#include "worker/registration/closest_point.h"

#include <gtest/gtest.h>

#include "tests/synthetic/families.h"
#include "tests/worker/registration/registration_testing.h"
#include "worker/spacetime/normals.h"

namespace liquidblend::registration {
namespace {

TEST(ClosestPointSearch, FindsTheFootOnASphereOfEachCellKind) {
  using Maker = mesh::SpaceTimeMesh (*)(int, const synthetic::ComplexOptions&);
  struct Case {
    Maker make;
    int size;
    float tolerance;  // edges; a cone's cells may not touch the vertex next to the foot
  };
  const std::vector<Case> cases = {{&synthetic::HexahedralSphere, 12, 0.15f},
                                   {&synthetic::WedgeSphere, 3, 0.15f},
                                   {&synthetic::TetrahedralSphere, 3, 0.15f},
                                   {&synthetic::MixedSphere, 12, 0.5f}};
  for (const auto& [make, size, tolerance] : cases) {
    mesh::SpaceTimeMesh mesh = make(size, {});
    mesh.edge_length_m = 0.2;
    spacetime::ComputeNormals(mesh, parallel::Arena(1));
    const Surface surface(mesh, mesh.edge_length_m);
    const ClosestPointSearch search(mesh, surface.points, surface.cells_around);
    const float radius = static_cast<float>(1.0 / mesh.edge_length_m);
    for (int n = 0; n < 40; ++n) {
      const float a = 0.37f * static_cast<float>(n), z = -0.9f + 0.045f * static_cast<float>(n);
      Eigen::Vector4f normal(std::sqrt(1 - z * z) * std::cos(a), std::sqrt(1 - z * z) * std::sin(a),
                             z, 0);
      Eigen::Vector4f query = 1.1f * radius * normal;
      query[3] = 3.4f;
      const auto found = search.Find(query, normal);
      ASSERT_TRUE(found.has_value());
      Eigen::Vector4f foot = radius * normal;
      foot[3] = 3.4f;
      EXPECT_NEAR((found->position - foot).norm(), 0, tolerance) << "cells of size " << size;
      EXPECT_GT(found->normal.dot(normal), 0.98f);
    }
  }
}

TEST(ClosestPointSearch, NeverMatchesASurfaceThatFacesAway) {
  const TestSurface sphere(SphereMesh());
  const ClosestPointSearch search(sphere.mesh, sphere.surface.points, sphere.surface.cells_around);
  const Eigen::Vector4f top = sphere.surface.points.col(sphere.surface.points.cols() / 2);
  const Eigen::Vector4f normal = sphere.mesh.normals.col(sphere.surface.points.cols() / 2);
  EXPECT_TRUE(search.Find(top, normal).has_value());
  EXPECT_FALSE(search.Find(top, -normal).has_value());
}

TEST(ClosestPointSearch, AtTheEndsOnlyTheEndSlabsCount) {
  const TestSurface sphere(SphereMesh());
  const ClosestPointSearch search(sphere.mesh, sphere.surface.points, sphere.surface.cells_around);
  for (int64_t v = 0; v < sphere.surface.points.cols(); v += 97) {
    const auto found = search.FindAtEnd(ClosestPointSearch::End::kFirst,
                                        sphere.surface.points.col(v), sphere.mesh.normals.col(v));
    if (found) {
      EXPECT_TRUE(sphere.surface.InFirstSlab(found->vertex));
    }
  }
}

}  // namespace
}  // namespace liquidblend::registration

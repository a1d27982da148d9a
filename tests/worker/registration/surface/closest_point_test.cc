#include "worker/registration/surface/closest_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <random>

#include "tests/synthetic/families.h"
#include "tests/worker/registration/registration_testing.h"
#include "worker/registration/surface/surface.h"
#include "worker/spacetime/field/normals.h"

namespace liquidblend::registration {
namespace {

// The distances of the `count` nearest points, one of each pair of columns being left out.
std::vector<float> NearestDistances(const Points& points, const Eigen::Vector4f& query,
                                    size_t count) {
  std::vector<float> all;
  for (int64_t n = 0; n < points.cols(); n += 2) all.push_back((points.col(n) - query).norm());
  std::partial_sort(all.begin(), all.begin() + static_cast<int64_t>(count), all.end());
  all.resize(count);
  return all;
}

TEST(PointTree, FindsTheNearestOfAllParts) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  constexpr int64_t kNumPoints = 5 * PointTree::kPartPoints;
  Points points(4, kNumPoints);
  std::vector<int32_t> every_second;
  for (int64_t n = 0; n < kNumPoints; ++n) {  // from part to part later in time, with some overlap
    const float time = 20 * (static_cast<float>(n) / kNumPoints + 0.3f * uniform(random));
    points.col(n) << 9 * uniform(random), 9 * uniform(random), 9 * uniform(random), time;
    if (n % 2 == 0) every_second.push_back(static_cast<int32_t>(n));
  }
  const PointTree tree(points, every_second, parallel::Arena(2));
  ASSERT_EQ(tree.size(), every_second.size());
  for (int n = 0; n < 60; ++n) {
    const Eigen::Vector4f query(12 * uniform(random) - 1, 9 * uniform(random), 9 * uniform(random),
                                32 * uniform(random) - 3);
    std::vector<int32_t> found(static_cast<size_t>(1 + n % 12));
    ASSERT_EQ(tree.Nearest(query, found), found.size());
    const std::vector<float> expected = NearestDistances(points, query, found.size());
    for (size_t k = 0; k < found.size(); ++k) {
      EXPECT_EQ(found[k] % 2, 0);
      EXPECT_NEAR((points.col(found[k]) - query).norm(), expected[k], 1e-5f);
    }
  }
}

TEST(PointTree, GivesTheSameForAnyThreadCount) {
  std::mt19937 random(3);
  constexpr int64_t kNumPoints = 2 * PointTree::kPartPoints + 10;
  Points points(4, kNumPoints);  // many of them the same
  for (float& x : points.reshaped()) x = static_cast<float>(random() % 40);
  std::vector<int32_t> all(kNumPoints);
  std::iota(all.begin(), all.end(), 0);
  const PointTree one(points, all, parallel::Arena(1)), eight(points, all, parallel::Arena(8));
  for (int n = 0; n < 100; ++n) {
    const Eigen::Vector4f query = points.col(1000 * n);
    std::array<int32_t, 5> of_one, of_eight;
    ASSERT_EQ(one.Nearest(query, of_one), 5U);
    ASSERT_EQ(eight.Nearest(query, of_eight), 5U);
    EXPECT_EQ(of_one, of_eight);
  }
}

TEST(PointTree, ToNowhereFindsNone) {
  const Points points = Points::Random(4, 100);
  const PointTree tree(points, {0, 1, 2, 50, 99}, parallel::Arena(2));
  std::array<int32_t, 2> found;
  for (const float x :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(tree.Nearest(Eigen::Vector4f(0, x, 0, 0), found), 0U);
  }
}

TEST(PointTree, OfNoPointsFindsNone) {
  const PointTree tree(Points(4, 3), {}, parallel::Arena(2));
  EXPECT_TRUE(tree.empty());
  std::array<int32_t, 2> found;
  EXPECT_EQ(tree.Nearest(Eigen::Vector4f::Zero(), found), 0U);
}

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
    const Surface surface(mesh, mesh.edge_length_m, parallel::Arena(2));
    const ClosestPointSearch search(mesh, surface.points, surface.cells_around, parallel::Arena(2));
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
  const ClosestPointSearch search(sphere.mesh, sphere.surface.points, sphere.surface.cells_around,
                                  parallel::Arena(2));
  const Eigen::Vector4f top = sphere.surface.points.col(sphere.surface.points.cols() / 2);
  const Eigen::Vector4f normal = sphere.mesh.normals.col(sphere.surface.points.cols() / 2);
  EXPECT_TRUE(search.Find(top, normal).has_value());
  EXPECT_FALSE(search.Find(top, -normal).has_value());
}

TEST(ClosestPointSearch, AtTheEndsOnlyTheEndSlabsCount) {
  const TestSurface sphere(SphereMesh());
  const ClosestPointSearch search(sphere.mesh, sphere.surface.points, sphere.surface.cells_around,
                                  parallel::Arena(2));
  int num_found = 0;
  for (int64_t v = 0; v < sphere.surface.points.cols(); v += 97) {
    const auto found = search.FindAtEnd(ClosestPointSearch::End::kFirst,
                                        sphere.surface.points.col(v), sphere.mesh.normals.col(v));
    if (!found) continue;
    ++num_found;
    EXPECT_TRUE(sphere.surface.InFirstSlab(found->vertex));
  }
  EXPECT_GT(num_found, 0);
}

}  // namespace
}  // namespace liquidblend::registration

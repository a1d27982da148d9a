#include "worker/registration/finish/folds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/mesh/slice_at.h"
#include "tests/synthetic/inverted_share.h"
#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

TEST(RelaxFolds, LeavesASmoothDisplacementAsItIs) {
  const TestSurface source(SphereMesh());
  Points displacement = 0.1f * source.surface.points;
  const Points before = displacement;
  EXPECT_EQ(RelaxFolds(source.surface, source.neighbors, 0.5f, parallel::Arena(2), displacement),
            0);
  EXPECT_EQ(displacement, before);
}

TEST(RelaxFolds, UnfoldsWhatIsFoldedAtTheWeight) {
  const TestSurface source(SphereMesh());
  Points displacement = Points::Zero(4, source.surface.points.cols());
  const int64_t centre = source.surface.points.cols() / 2;
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    const Eigen::Vector4f offset = source.surface.points.col(v) - source.surface.points.col(centre);
    if (offset.norm() < 2.0f) displacement.col(v) = -2.5f * offset;  // mirrored about the centre
  }
  const Points folded = displacement;
  const parallel::Arena arena(2);
  Points hardly_moved = displacement;
  EXPECT_EQ(RelaxFolds(source.surface, source.neighbors, 0.1f, arena, hardly_moved), 0);
  EXPECT_EQ(hardly_moved, folded) << "at a small weight nothing is turned";
  EXPECT_EQ(RelaxFolds(source.surface, source.neighbors, 1, arena, displacement), 0);
  EXPECT_NE(displacement, folded);
}

// A sphere at rest that lies on itself.
struct OnItself : TestSurface {
  OnItself()
      : TestSurface(
            BuildMesh(synthetic::MovingSphere({.velocity_m_per_s = Eigen::Vector3f::Zero()}))),
        search(mesh, surface.points, surface.cells_around, parallel::Arena(2)) {}
  int64_t Offset(Points& displacement) const {
    return OffsetInvertedLayers(surface, neighbors, search, parallel::Arena(2), displacement);
  }
  double InvertedShare(Points displacement) const {
    displacement.topRows<3>() *= static_cast<float>(mesh.edge_length_m);
    const std::vector<double> times = {0.6, 1.4, 2.3};
    synthetic::CrossingCount count;
    for (const auto& slice :
         mesh::SliceAt(mesh, mesh.vertices + displacement, times, parallel::Arena(2))) {
      count += synthetic::CountInverted(slice, 0.25 * mesh.edge_length_m);
    }
    return count.inverted_share();
  }
  ClosestPointSearch search;
};

TEST(OffsetInvertedLayers, LeavesASingleLayerAsItIs) {
  const OnItself source;
  Points displacement = Points::Constant(4, source.surface.points.cols(), 0.05f);
  const Points before = displacement;
  EXPECT_EQ(source.Offset(displacement), 0);
  EXPECT_EQ(displacement, before);
}

TEST(OffsetInvertedLayers, HidesAFoldThatLiesOnTheTarget) {
  const OnItself source;
  Points displacement = Points::Zero(4, source.surface.points.cols());
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    const Eigen::Vector4f p = source.surface.points.col(v);
    const float radius = std::hypot(p[0], p[2]), angle = std::atan2(p[0], p[2]);
    // Turned about y, back and forth: three layers at the top, the middle one upside down.
    const float turned = angle - 2 * angle * std::exp(-9 * angle * angle);
    displacement(0, v) = radius * std::sin(turned) - p[0];
    displacement(2, v) = radius * std::cos(turned) - p[2];
  }
  const double before = source.InvertedShare(displacement);
  ASSERT_GT(before, 0.0);
  EXPECT_GT(source.Offset(displacement), 0);
  EXPECT_LT(source.InvertedShare(displacement), 0.3 * before);
}

}  // namespace
}  // namespace liquidblend::registration

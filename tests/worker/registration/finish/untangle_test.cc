#include "worker/registration/finish/untangle.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/base/data_limit.h"
#include "core/mesh/slice_at.h"
#include "tests/allocation_testing.h"
#include "tests/synthetic/inverted_share.h"
#include "tests/worker/registration/registration_testing.h"
#include "worker/registration/surface/blend_figures.h"

namespace liquidblend::registration {
namespace {

// A sphere that lies still, and ways to squash it.
struct Squashed : TestSurface {
  Squashed()
      : TestSurface(
            BuildMesh(synthetic::MovingSphere({.velocity_m_per_s = Eigen::Vector3f::Zero()}))) {}

  // Heights over its middle times 1 - `by`: beyond 1 its top lies below its bottom.
  Points By(float by) const {
    const Points& points = surface.points;
    Points displacement = Points::Zero(4, points.cols());
    displacement.row(2) = by * (points.row(2).mean() - points.row(2).array()).matrix();
    return displacement;
  }
  Points AtRest() const { return By(0); }
  int64_t Untangle(const Points& extrapolation, Points& displacement, int num_threads = 2) const {
    return registration::Untangle(surface, extrapolation, parallel::Arena(num_threads),
                                  displacement);
  }
  double InvertedShare(const Points& displacement) const {
    const std::vector<double> times = {0.6, 1.4, 2.3};  // between those that are looked at
    synthetic::CrossingCount count;
    for (const auto& slice :
         mesh::SliceAt(mesh, BlendAt(surface, displacement, 1), times, parallel::Arena(2))) {
      count += synthetic::CountInverted(slice, 0.25 * mesh.edge_length_m);
    }
    return count.inverted_share();
  }
};

TEST(Untangle, LeavesWhatIsInOrderAsItIs) {
  const Squashed source;
  Points displacement = source.By(0.7f);
  const Points before = displacement;
  EXPECT_EQ(source.Untangle(source.By(0.2f), displacement), 0);
  EXPECT_TRUE(displacement == before);
}

TEST(Untangle, LooksWhereVerticesAreWhateverTheDuration) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  Squashed source;
  source.mesh.num_frames = 2'000'000'000;  // a number for each would be 16 GB
  Points displacement = source.By(0.7f);
  const base::ScopedDataLimit limit(256 << 20);
  EXPECT_EQ(source.Untangle(source.AtRest(), displacement), 0);
}

TEST(Untangle, PutsTheSidesOfASheetInOrder) {
  const Squashed source;
  Points displacement = source.By(1.02f);
  const Points before = displacement;
  ASSERT_GT(source.InvertedShare(before), 0.5);
  source.Untangle(source.AtRest(), displacement);
  EXPECT_LT(source.InvertedShare(displacement), 0.02);
  EXPECT_LT((displacement - before).colwise().norm().maxCoeff(), 1.0f) << "edges";
  EXPECT_TRUE(displacement.row(3) == before.row(3)) << "only in space";
}

TEST(Untangle, LooksOnTheWayToTheTarget) {
  const Squashed source;
  Points displacement = source.By(1.36f);  // just inside out at 0.75, far beyond it at 1
  const double before = source.InvertedShare(0.75f * displacement);
  ASSERT_GT(before, 0.5);
  source.Untangle(source.AtRest(), displacement);
  EXPECT_LT(source.InvertedShare(0.75f * displacement), 0.1 * before);
}

TEST(Untangle, LooksBeyondTheTarget) {
  const Squashed source;
  Points displacement = source.By(0.9f);
  const Points extrapolation = source.By(0.5f);  // 1.025 at weight 1.25
  ASSERT_EQ(source.InvertedShare(displacement), 0.0);
  ASSERT_GT(source.InvertedShare(displacement + 0.25f * extrapolation), 0.5);
  source.Untangle(extrapolation, displacement);
  EXPECT_EQ(source.InvertedShare(displacement), 0.0);
  EXPECT_LT(source.InvertedShare(displacement + 0.25f * extrapolation), 0.02);
}

TEST(Untangle, LeavesRigidPiecesAlone) {
  const TestSurface source(BuildMesh(BlockAndDroplet(0.5f), kDropletVertices));
  const std::vector<char>& rigid = source.surface.rigid;
  const Points& points = source.surface.points;
  double num_rigid = 0, middle = 0;
  for (int64_t v = 0; v < points.cols(); ++v) {
    num_rigid += rigid[v];
    middle += rigid[v] != 0 ? points(1, v) : 0;
  }
  ASSERT_GT(num_rigid, 0);
  middle /= num_rigid;
  Points displacement = Points::Zero(4, points.cols());
  for (int64_t v = 0; v < points.cols(); ++v) {  // the droplet mirrored in itself: inside out
    if (rigid[v] != 0) displacement(1, v) = 2 * (static_cast<float>(middle) - points(1, v));
  }
  const Points before = displacement;
  EXPECT_GT(Untangle(source.surface, before, parallel::Arena(2), displacement), 0);
  EXPECT_TRUE(displacement == before);
}

TEST(Untangle, IsTheSameForAnyNumberOfThreads) {
  const Squashed source;
  Points one = source.By(1.02f), two = one, eight = one;
  const int64_t num_left = source.Untangle(source.AtRest(), one, 1);
  EXPECT_EQ(source.Untangle(source.AtRest(), two, 2), num_left);
  EXPECT_EQ(source.Untangle(source.AtRest(), eight, 8), num_left);
  EXPECT_TRUE(one != source.By(1.02f));
  EXPECT_TRUE(one == two);
  EXPECT_TRUE(one == eight);
}

}  // namespace
}  // namespace liquidblend::registration

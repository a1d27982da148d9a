#include "worker/registration/features/starts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/mesh/components.h"
#include "core/mesh/slice_at.h"
#include "tests/worker/registration/drops_testing.h"
#include "worker/registration/features/automatic.h"
#include "worker/registration/register.h"

namespace liquidblend::registration::starts_test {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

constexpr double kHeight = 0.65;

OpenStarts Find(const TestSurface& source, const TestSurface& target) {
  return FindOpenStarts(FindTrackFeatures(source.surface), FindTrackFeatures(target.surface),
                        ScaleOf(source.surface, target.surface));
}

Registration Registered(const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target,
                        int num_threads = 2, bool automatic = true) {
  RegistrationOptions options;
  options.automatic_correspondences = automatic;
  options.sample_share = 0.2;  // the meshes are small
  options.max_iterations = 10;
  auto result = Register(source, target, {}, options, parallel::Arena(num_threads));
  EXPECT_TRUE(result.ok()) << result.status();
  return *std::move(result);
}

// How far the falling drop's vertices are moved while it is apart, in mean edges; they should stay.
double MeanMiss(const mesh::SpaceTimeMesh& source, const Registration& result, double height_m) {
  double sum = 0, count = 0;
  for (int64_t v = 0; v < source.num_vertices(); ++v) {
    const Eigen::Vector4f p = source.vertices.col(v);
    const double bottom = height_m - kDropRadius - 0.05 * p[3];  // it falls 0.05 m a frame
    if (p[3] < 0 || p[3] > 4 || p[2] < bottom - 0.02) continue;
    Eigen::Vector4f miss = result.displacement.col(v);
    miss.head<3>() /= static_cast<float>(source.edge_length_m);
    sum += miss.norm();
    ++count;
  }
  return sum / count;
}

mesh::SpaceTimeMesh FreeDrop() { return Scene({DropAt(0, kHeight)}); }
mesh::SpaceTimeMesh BridgedDrop() { return Scene({BridgedDropAt(0, kHeight)}); }

TEST(OpenStarts, AreThoseWithoutACounterpart) {
  const TestSurface free(FreeDrop()), bridged(BridgedDrop());
  const OpenStarts in_source = Find(free, bridged), in_target = Find(bridged, free);
  ASSERT_EQ(in_source.source.size(), 1u);
  EXPECT_TRUE(in_source.target.empty());
  EXPECT_NEAR(free.mesh.edge_length_m * in_source.source[0].parts[0].centre[2], kHeight, 0.05);
  EXPECT_EQ(in_target.target.size(), 1u);
  EXPECT_TRUE(in_target.source.empty());
}

TEST(OpenStarts, PartsThatPairAreNone) {
  const TestSurface two(Scene({DropAt(-0.5, 0.6), DropAt(0.5, 0.8)}));
  const TestSurface one_bridged(Scene({BridgedDropAt(-0.5, 0.6), DropAt(0.5, 0.8)}));
  const TestSurface other(Scene({DropAt(-0.6, 0.8), DropAt(0.6, 0.6)}));
  EXPECT_TRUE(Find(two, other).empty());
  const OpenStarts open = Find(two, one_bridged);
  ASSERT_EQ(open.source.size(), 1u);
  EXPECT_LT(open.source[0].parts[0].centre[0], 0);
}

// As many parts are apart in both, but other ones.
TEST(OpenStarts, AreOfBothWhereAnotherDropIsBridged) {
  const TestSurface left(Scene({BridgedDropAt(-0.5, 0.6), DropAt(0.5, 0.8)}));
  const TestSurface right(Scene({DropAt(-0.5, 0.8), BridgedDropAt(0.5, 0.6)}));
  const OpenStarts open = Find(left, right);
  ASSERT_EQ(open.source.size(), 1u);
  EXPECT_GT(open.source[0].parts[0].centre[0], 0);
  ASSERT_EQ(open.target.size(), 1u);
  EXPECT_LT(open.target[0].parts[0].centre[0], 0);
}

TEST(OpenStarts, AFreeDropStaysOneOnADropThatIsBridged) {
  const auto source = FreeDrop();
  const Registration result = Registered(source, BridgedDrop(), 2, /*automatic=*/false);
  // 0.42 if the first frames are pulled onto one another, neck and all.
  EXPECT_LT(MeanMiss(source, result, kHeight), 0.25);
}

// It falls by 0.05 m a frame, and half-way nearly twice as fast, from half-way down to the other.
TEST(OpenStarts, HalfWayAFreeDropFallsFromBetweenItsHeightAndThatOfTheBridgedOne) {
  const auto source = FreeDrop();
  const Registration result = Registered(source, Scene({BridgedDropAt(0, kHeight - 0.15)}));
  const Eigen::Matrix4Xf half = source.vertices + 0.5f * result.displacement;
  const double times[] = {1};
  const mesh::TriangleMesh slice = mesh::SliceAt(source, half, times, parallel::Arena(2))[0];
  EXPECT_EQ(mesh::ComponentVolumes(slice).size(), 2u);
  EXPECT_NEAR(slice.vertices.row(2).maxCoeff(), kHeight - 0.075 - 0.05 + kDropRadius, 0.05);
}

TEST(OpenStarts, AreNamedWithPlaceAndTimeInBothDirections) {
  const auto free = FreeDrop(), bridged = BridgedDrop();
  EXPECT_THAT(
      Registered(free, bridged).report.verdict.reason,
      MatchesRegex(".*; a part of the source at .0.00, -?0.00, 0.6.. m is apart from frame 0 "
                   "to [5-9], but not in the first frame of the target"));
  EXPECT_THAT(Registered(bridged, free).report.verdict.reason, HasSubstr("; a part of the target"));
  EXPECT_THAT(Registered(free, free).report.verdict.reason, Not(HasSubstr("a part of")));
}

TEST(OpenStarts, GiveTheSameBytesForAnyNumberOfThreads) {
  const auto source = FreeDrop(), target = BridgedDrop();
  EXPECT_EQ(Registered(source, target, 1).displacement, Registered(source, target, 8).displacement);
}

}  // namespace
}  // namespace liquidblend::registration::starts_test

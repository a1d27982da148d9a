#include "worker/registration/finish/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration::verdict_test {
namespace {

using ::testing::AllOf;
using ::testing::DoubleNear;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kDropHeight = 0.55;  // of FallingDrop's at frame 0

// What Judge() takes, for a registration that is not worked out but given.
struct Pair {
  Pair(const mesh::Animation& a, const mesh::Animation& b)
      : source(BuildMesh(a)),
        target_mesh(BuildMesh(b)),
        target(target_mesh, source.mesh.edge_length_m, parallel::Arena(2)),
        search(target_mesh, target.points, target.cells_around, parallel::Arena(2)) {}
  mesh::Verdict Judged(const Points& displacement, int num_threads = 2) const {
    return Judge(source.surface, source.neighbors, target, search, displacement, {}, {},
                 TimesBlend::kLinearly, parallel::Arena(num_threads));
  }
  Points Unmoved() const { return Points::Zero(4, source.surface.points.cols()); }

  TestSurface source;
  mesh::SpaceTimeMesh target_mesh;
  Surface target;
  ClosestPointSearch search;
};

mesh::Animation Drop(double radius_m = 0.2) {
  synthetic::FallingDropOptions options;
  options.drop_radius_m = radius_m;
  options.num_frames = 8;
  return synthetic::FallingDrop(options);
}

TEST(Judge, FindsNoFaultWithAnAnimationAndItself) {
  const Pair pair(Drop(), Drop());
  const mesh::Verdict verdict = pair.Judged(pair.Unmoved());
  EXPECT_EQ(verdict.grade, mesh::Grade::kGood) << verdict.reason;
  EXPECT_GT(verdict.residual_histogram[0], 0.99);
  EXPECT_GT(verdict.compatible_share, 0.99);
  EXPECT_GT(verdict.covered_share, 0.99);
  EXPECT_EQ(verdict.stretch, 0.0);
  EXPECT_EQ(verdict.inverted_share, 0.0);
  EXPECT_EQ(verdict.component_error, 0.0);
  EXPECT_THAT(verdict.volume_errors, Each(::testing::DoubleNear(0.0, 1e-5)));
  EXPECT_NEAR(verdict.relief_loss, 0.0, 1e-6);
}

TEST(Judge, HistogramAndIncompatibleShareAddUpToOne) {
  const Pair pair(Drop(), Drop(0.3));
  const mesh::Verdict verdict = pair.Judged(pair.Unmoved());
  const auto& bins = verdict.residual_histogram;
  EXPECT_NEAR(std::accumulate(bins.begin(), bins.end(), 0.0), verdict.compatible_share, 1e-9);
  EXPECT_GT(bins[4], 0.01);  // the drops' radii differ by 0.1 m, that is about 1.5 edges
}

TEST(Judge, NamesTheDropThatHasNoCounterpart) {
  // The pool of a drop that is too small and too high to be seen.
  mesh::Animation pool = Drop();
  synthetic::FallingDropOptions high;
  high.drop_m = {0, 0, 5};
  high.num_frames = 8;
  pool.frames = synthetic::FallingDrop(high).frames;
  for (const bool drop_in_source : {true, false}) {
    const Pair pair(drop_in_source ? Drop() : pool, drop_in_source ? pool : Drop());
    const mesh::Verdict verdict = pair.Judged(pair.Unmoved());
    EXPECT_NE(verdict.grade, mesh::Grade::kGood);

    EXPECT_GT(verdict.unmatched_share, 0.2);
    EXPECT_GT(verdict.component_error, 0.2);
    EXPECT_NEAR(verdict.worst[0], 0.0, 0.3);
    EXPECT_NEAR(verdict.worst[1], 0.0, 0.3);
    EXPECT_GT(verdict.worst[2], 0.05);
    EXPECT_LT(verdict.worst[2], kDropHeight + 0.2);
    EXPECT_GE(verdict.worst[3], 0.0);
    EXPECT_LE(verdict.worst[3], 7.0);
  }
}

TEST(Judge, SeesASurfaceThatIsInsideOut) {
  const Pair pair(Drop(), Drop());
  Points displacement = pair.Unmoved();
  displacement.row(0) = -2 * pair.source.surface.points.row(0);  // mirrored: all of it at weight 1
  const mesh::Verdict verdict = pair.Judged(displacement);
  EXPECT_EQ(verdict.grade, mesh::Grade::kTooDifferent);
  EXPECT_GT(verdict.inverted_share, 0.4);
  EXPECT_LT(verdict.compatible_share, 0.1);
}

TEST(Judge, ComparesTheHalfWayVolumeWithTheMeanOfBoth) {
  const Pair pair(Drop(), Drop());
  Points displacement = pair.source.surface.points;
  displacement.row(3).setZero();  // twice as large at weight 1, 3/2 at weight 0.5
  const std::vector<double> errors = pair.Judged(displacement).volume_errors;
  EXPECT_THAT(errors, Not(IsEmpty()));
  EXPECT_THAT(errors, Each(DoubleNear(1.5 * 1.5 * 1.5 - 1, 0.01)));
}

TEST(Judge, HasTheSameBytesForAnyNumberOfThreads) {
  const Pair pair(Drop(), Drop(0.25));
  const mesh::Verdict one = pair.Judged(pair.Unmoved(), 1);
  for (const int num_threads : {2, 8}) {
    const mesh::Verdict other = pair.Judged(pair.Unmoved(), num_threads);
    EXPECT_EQ(other.reason, one.reason);
    EXPECT_EQ(other.worst, one.worst);
    EXPECT_EQ(other.residual_histogram, one.residual_histogram);
    EXPECT_EQ(other.stretch, one.stretch);
    EXPECT_EQ(other.inverted_share, one.inverted_share);
    EXPECT_EQ(other.volume_errors, one.volume_errors);
    EXPECT_EQ(other.relief_loss, one.relief_loss);
  }
}

mesh::Verdict Faultless() {
  mesh::Verdict verdict;
  verdict.compatible_share = 1.0;
  verdict.covered_share = 1.0;
  verdict.volume_errors = {0.0, 0.001};
  return verdict;
}

mesh::Verdict Graded(mesh::Verdict verdict) {
  WorstPlaces places;
  places.unmatched = {1, 2, 3, 4};
  places.inverted = {5, 6, 7, 8};
  SetGrade(places, verdict);
  return verdict;
}

TEST(SetGrade, IsThatOfTheWorstFigureAndNamesIt) {
  EXPECT_EQ(Graded(Faultless()).grade, mesh::Grade::kGood);
  mesh::Verdict verdict = Faultless();
  verdict.covered_share = 0.958;
  EXPECT_EQ(Graded(verdict).grade, mesh::Grade::kDoubtful);
  EXPECT_THAT(Graded(verdict).reason, HasSubstr("4.2 % of the target is not covered"));
  EXPECT_EQ(Graded(verdict).worst[0], 1);
  verdict.inverted_share = 0.2;
  EXPECT_EQ(Graded(verdict).grade, mesh::Grade::kTooDifferent);
  EXPECT_THAT(Graded(verdict).reason, HasSubstr("20 % of the surface is inside out"));
  EXPECT_EQ(Graded(verdict).worst[0], 5);
}

TEST(SetGrade, NamesTheReliefOfBothAnimationsWhereItIsLost) {
  mesh::Verdict verdict = Faultless();
  verdict.relief_loss = 0.19;
  EXPECT_EQ(Graded(verdict).grade, mesh::Grade::kGood);
  verdict.relief_loss = 0.29;
  WorstPlaces places;
  places.relief = {1, 2, 3, 40};
  places.relief_of_target = {5, 6, 7};
  SetGrade(places, verdict);
  EXPECT_EQ(verdict.grade, mesh::Grade::kDoubtful);
  EXPECT_THAT(verdict.reason, HasSubstr("29 % of the relief (craters, jets, waves) is lost"));
  EXPECT_THAT(verdict.reason,
              HasSubstr(" (around (1, 2, 3) m in the source, (5, 6, 7) m in the target)"));
  EXPECT_EQ(verdict.worst[3], 40);
}

TEST(SetGrade, OfAPartThatIsNotThereIsDoubtful) {
  mesh::Verdict verdict = Faultless();
  verdict.part_shift = 1;
  WorstPlaces places;
  places.shifted_part = {1, 2, 3, 4};
  SetGrade(places, verdict);
  EXPECT_EQ(verdict.grade, mesh::Grade::kDoubtful);
  EXPECT_THAT(verdict.reason, HasSubstr("(good below 0.5)"));
  EXPECT_EQ(verdict.worst[0], 1);
}

TEST(SetGrade, AddsUpFiguresThatAreGoodAlone) {
  mesh::Verdict verdict = Faultless();
  verdict.compatible_share = 0.97;
  EXPECT_EQ(Graded(verdict).grade, mesh::Grade::kGood);
  verdict.stretch = 0.19;
  EXPECT_EQ(Graded(verdict).grade, mesh::Grade::kDoubtful);
  verdict.volume_errors = {0.04, -0.04};
  EXPECT_EQ(Graded(verdict).grade, mesh::Grade::kTooDifferent);
  EXPECT_THAT(Graded(verdict).reason,
              AllOf(HasSubstr("5.6 in sum"), HasSubstr("most of it: 4 % is the half-way blend's")));
}

TEST(SetGrade, OfWhatIsNoNumberIsTooDifferent) {
  mesh::Verdict verdict = Faultless();
  verdict.volume_errors[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Graded(verdict).grade, mesh::Grade::kTooDifferent);
}

}  // namespace
}  // namespace liquidblend::registration::verdict_test

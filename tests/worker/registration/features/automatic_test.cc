#include "worker/registration/features/automatic.h"

#include <gmock/gmock.h>

#include "tests/worker/registration/drops_testing.h"
#include "tests/worker/registration/pillar_testing.h"
#include "tests/worker/registration/strike_testing.h"
#include "worker/registration/register.h"

namespace liquidblend::registration {
namespace {

std::vector<AutomaticCorrespondence> FindPoints(const Surface& source, const Surface& target,
                                                const std::vector<Correspondence>& users,
                                                double edge_length_m) {
  const FeaturesOfPair features = FindFeatures(source, target, {}, parallel::Arena(2));
  const FeaturePairs pairs =
      PairFeatures(features.source, features.target, ScaleOf(source, target));
  return FindAutomatic(source, target, features, pairs, users, edge_length_m, parallel::Arena(2));
}

class AutomaticTest : public ::testing::Test {
 protected:
  std::vector<AutomaticCorrespondence> Find(const std::vector<Correspondence>& users) const {
    return FindPoints(source_.surface, Target(), users, source_.mesh.edge_length_m);
  }
  Surface Target() const {
    return Surface(target_, source_.mesh.edge_length_m, parallel::Arena(2));
  }
  TestSurface source_{Scene({DropAt(-0.2, 0.6)}, 0.6)};
  mesh::SpaceTimeMesh target_ = Scene({DropAt(0.1, 0.7)}, 0.6);
};

TEST_F(AutomaticTest, ADropGivesSoftPointsAtItsSixSidesWhereItStarts) {
  const auto found = Find({});
  ASSERT_EQ(found.size(), 6u);
  for (const auto& [c, confidence] : found) {
    EXPECT_EQ(c.kind, CorrespondenceKind::kPoint);
    EXPECT_FALSE(c.hard);
    EXPECT_GT(confidence, 0.8);
    const double edge = source_.mesh.edge_length_m;
    EXPECT_NEAR((c.source.head<3>() - Eigen::Vector3d(-0.2, 0, 0.6)).norm(), kDropRadius, edge);
    EXPECT_NEAR((c.target.head<3>() - Eigen::Vector3d(0.1, 0, 0.7)).norm(), kDropRadius, edge);
    EXPECT_EQ(c.source[3], 0);
    EXPECT_EQ(c.target[3], 0);
  }
}

TEST(Automatic, WhereADropLivesMuchLongerInOneOfThemItsMotionIsGivenToo) {
  const TestSurface source(Scene({DropAt(-0.2, 0.6)}, 0.6, 24));
  const TestSurface target(Scene({DropAt(0.1, 0.7, 9)}, 0.6, 24));
  const auto found = FindPoints(source.surface, target.surface, {}, source.mesh.edge_length_m);
  ASSERT_EQ(found.size(), 18u);
  for (const size_t n : {6, 12}) {
    const Correspondence &before = found[n - 6].correspondence, &c = found[n].correspondence;
    EXPECT_GT(c.source[3], before.source[3] + 1);
    EXPECT_GT(c.target[3], before.target[3] + 5);
    EXPECT_LT(c.target[3], before.target[3] + 10.5);
    EXPECT_LT(c.source[2], before.source[2]);
  }
}

TEST_F(AutomaticTest, AUsersOwnNearByTakesItsPlace) {
  Correspondence user;
  user.source = {-0.2, 0, 0.85, 0};
  user.target = {0.5, 0, 0.0, 6};
  EXPECT_TRUE(Find({user}).empty());
  user.source = {0.5, 0.3, -0.3, 11};
  user.target = user.source;
  EXPECT_EQ(Find({user}).size(), 6u) << "far from the drop";
}

TEST(Automatic, ADropThatStrikesElsewhereTakesItsCraterAlongUnlessTheUserKnowsBetter) {
  const TestSurface source(StrikeMesh({.x = -0.45, .crater_x = -0.45}));
  const TestSurface target(StrikeMesh({.x = 0.45, .crater_x = 0.45}));
  const double edge = source.mesh.edge_length_m;
  const auto found = FindPoints(source.surface, target.surface, {}, edge);
  ASSERT_GE(found.size(), 10u) << "six of the drop, and the crater's";
  for (const auto& [c, confidence] : found) {
    EXPECT_EQ(c.kind, CorrespondenceKind::kPoint);
    EXPECT_FALSE(c.hard);
    EXPECT_NEAR(c.target[0] - c.source[0], 0.9, edge);
  }
  const auto with = [&](const Correspondence& user) {
    return FindPoints(source.surface, target.surface, {user}, edge);
  };
  Correspondence crater = found.back().correspondence, drop = found.front().correspondence;
  EXPECT_EQ(with(crater).size(), found.size()) << "agrees";
  EXPECT_EQ(with(drop).size(), found.size());
  crater.target[0] += 4 * edge;
  EXPECT_EQ(with(crater).size(), 6u) << "those of the drop";
  drop.target[0] += 4 * edge;
  EXPECT_EQ(with(drop).size(), 1u) << "the lowest point of all, as an extremum";
}

TEST(Automatic, APillarElsewhereGivesSoftSpacesUnlessAUsersIsNear) {
  const TestSurface source(BuildMesh(PoolAroundPillar({.x = -0.4})));
  const TestSurface target(BuildMesh(PoolAroundPillar({.x = 0.4})));
  const double edge = source.mesh.edge_length_m;
  const auto found = FindPoints(source.surface, target.surface, {}, edge);
  EXPECT_EQ(found.size(), kMaxContactPairs);
  for (const auto& [c, confidence] : found) {
    EXPECT_EQ(c.kind, CorrespondenceKind::kSpace);
    EXPECT_FALSE(c.hard);
    EXPECT_GT(confidence, 0.5);
    EXPECT_NEAR(c.target[0] - c.source[0], 0.8, 2 * edge);
  }
  Correspondence user;
  user.source = user.target = {-0.4 + kPillarRadius, 0, -0.3, 11};
  EXPECT_TRUE(FindPoints(source.surface, target.surface, {user}, edge).empty());
}

TEST(Automatic, APillarThatStaysGivesNone) {
  const TestSurface test(BuildMesh(PoolAroundPillar({.x = 0.2})));
  EXPECT_TRUE(FindPoints(test.surface, test.surface, {}, test.mesh.edge_length_m).empty());
}

TEST_F(AutomaticTest, TheReportTellsThemFromTheUsersAndTheOptionTurnsThemOff) {
  Correspondence user;
  user.source = user.target = {0.5, 0.4, 0, 11};
  RegistrationOptions options;
  options.max_iterations = 2;
  const auto with = Register(source_.mesh, target_, {user}, options, parallel::Arena(2));
  ASSERT_TRUE(with.ok()) << with.status();
  const auto& reports = with->report.correspondences;
  ASSERT_EQ(reports.size(), 7u);
  EXPECT_EQ(reports[0].correspondence, user);
  EXPECT_FALSE(reports[0].automatic);
  EXPECT_TRUE(reports[1].automatic);
  EXPECT_GT(reports[1].confidence, 0.8);
  EXPECT_LT(reports[1].confidence, 1);
  options.automatic_correspondences = false;
  const auto off = Register(source_.mesh, target_, {user}, options, parallel::Arena(2));
  ASSERT_TRUE(off.ok()) << off.status();
  EXPECT_EQ(off->report.correspondences.size(), 1u);
}

TEST_F(AutomaticTest, PartsAreFoundFromADiameterOn) {
  const double diameter_edges = 2 * kDropRadius / source_.mesh.edge_length_m;
  EXPECT_EQ(FindFeatures(source_.surface, {.min_diameter = 0.9 * diameter_edges}).tracks.size(),
            1u);
  EXPECT_TRUE(FindFeatures(source_.surface, {.min_diameter = 1.1 * diameter_edges}).tracks.empty());
}

TEST(Automatic, NothingStandsOutOfOneBall) {
  const TestSurface ball(SphereMesh());
  EXPECT_TRUE(FindFeatures(ball.surface).tracks.empty());
  EXPECT_TRUE(FindPoints(ball.surface, ball.surface, {}, ball.mesh.edge_length_m).empty());
}

}  // namespace
}  // namespace liquidblend::registration

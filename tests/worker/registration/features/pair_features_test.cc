#include "worker/registration/features/pair_features.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace liquidblend::registration::pair_features_test {
namespace {

constexpr SceneScale kScale = {.length = 100, .frames = 60};

// A drop that falls straight down from the first frame to its merge.
Track Drop(const Eigen::Vector3d& from, double merge_frame, double volume = 200) {
  Track track;
  track.end = TrackEnd::kMerge;
  track.end_time = merge_frame;
  track.volume = volume;
  for (const double share : {0.0, 1.0}) {
    Part part;
    part.centre << from[0], from[1], (1 - share) * from[2], share * merge_frame;
    part.volume = volume;
    track.parts.push_back(part);
  }
  return track;
}

Track Splash(const Eigen::Vector3d& from, double frame) {
  Track track = Drop(from, 6);
  track.start = TrackStart::kSplit;
  track.start_time = frame;
  track.end_time = frame + 6;
  for (Part& part : track.parts) part.centre[3] += frame;
  return track;
}

Extremum Apex(const Eigen::Vector4d& point, double persistence = 20) {
  return {ExtremumKind::kApex, point, persistence};
}

std::vector<std::pair<int, int>> Numbers(const std::vector<AssignedPair>& pairs) {
  std::vector<std::pair<int, int>> numbers;
  for (const AssignedPair& pair : pairs) numbers.emplace_back(pair.row, pair.column);
  return numbers;
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

TEST(PairFeatures, DropsMovedTheSameWayKeepTheirPartnersInWhateverOrder) {
  const Features source{{Drop({0, 0, 20}, 9), Drop({20, 0, 20}, 9)}, {}};
  const Features target{{Drop({36, 0, 20}, 9), Drop({16, 0, 20}, 9)}, {}};
  const auto pairs = PairFeatures(source, target, kScale);
  EXPECT_THAT(Numbers(pairs.tracks), ElementsAre(Pair(0, 1), Pair(1, 0)));
}

TEST(PairFeatures, ADropThatStrikesLaterIsTheSame) {
  const Features source{{Drop({-20, 0, 10}, 5), Drop({20, 0, 30}, 20)}, {}};
  const Features target{{Drop({-20, 0, 30}, 20), Drop({20, 0, 10}, 5)}, {}};
  const auto pairs = PairFeatures(source, target, kScale);
  EXPECT_THAT(Numbers(pairs.tracks), ElementsAre(Pair(0, 0), Pair(1, 1)));
}

TEST(PairFeatures, ADropWithoutAPartnerStaysAlone) {
  const Features both{{Drop({0, 0, 20}, 9), Drop({40, 0, 20}, 9)}, {}};
  const Features one{{Drop({38, 0, 22}, 9)}, {}};
  EXPECT_THAT(Numbers(PairFeatures(both, one, kScale).tracks), ElementsAre(Pair(1, 0)));
  EXPECT_THAT(Numbers(PairFeatures(one, both, kScale).tracks), ElementsAre(Pair(0, 1)));
  const Features larger{{Drop({38, 0, 22}, 9, 2000)}, {}};
  EXPECT_THAT(PairFeatures(both, larger, kScale).tracks, IsEmpty());
  EXPECT_THAT(PairFeatures(both, {}, kScale).tracks, IsEmpty());
}

TEST(PairFeatures, TheTwoPartnersThatAreCheapestToExchangeAreExchanged) {
  const Features source{{Drop({0, 0, 20}, 9), Drop({20, 0, 20}, 9), Drop({-50, 0, 20}, 9)}, {}};
  const Features target{{Drop({2, 0, 20}, 9), Drop({22, 0, 20}, 9), Drop({-48, 0, 20}, 9)}, {}};
  const auto found = PairFeatures(source, target, kScale);
  EXPECT_THAT(Numbers(found.tracks), ElementsAre(Pair(0, 0), Pair(1, 1), Pair(2, 2)));
  const auto exchanged = PairFeatures(source, target, kScale, {.exchange = true});
  EXPECT_THAT(Numbers(exchanged.tracks), ElementsAre(Pair(0, 1), Pair(1, 0), Pair(2, 2)));
}

TEST(PairFeatures, OnePairIsNotExchanged) {
  const Features drop{{Drop({0, 0, 20}, 9)}, {}};
  EXPECT_THAT(Numbers(PairFeatures(drop, drop, kScale, {.exchange = true}).tracks),
              ElementsAre(Pair(0, 0)));
}

TEST(PairFeatures, AQuarterTurnOfTwinsIsAmbiguousAndGivesNone) {
  const Features source{{Drop({-20, 0, 20}, 9), Drop({20, 0, 20}, 9)}, {}};
  const Features target{{Drop({0, -20, 20}, 9), Drop({0, 20, 20}, 9)}, {}};
  EXPECT_THAT(PairFeatures(source, target, kScale).tracks, IsEmpty());
}

Lump LumpAt(double x, double height) {
  return {.place = {x, 0}, .height = height, .prominence = height, .diameter = 8};
}

TEST(PairFeatures, ADropThatTouchesThePoolInTheOtherAnimationIsNotTheOtherDrop) {
  Features source{{Drop({20, 0, 20}, 9)}, {}}, target{{Drop({-20, 0, 20}, 9)}, {}};
  EXPECT_THAT(Numbers(PairFeatures(source, target, kScale).tracks), ElementsAre(Pair(0, 0)))
      << "nothing tells them apart";
  source.lumps = {LumpAt(-20, 8), LumpAt(20, 20)};
  target.lumps = {LumpAt(-20, 20), LumpAt(20, 8)};
  EXPECT_THAT(PairFeatures(source, target, kScale).tracks, IsEmpty());
  source.lumps = {LumpAt(20, 20)};
  target.lumps = {LumpAt(-20, 20)};
  EXPECT_THAT(Numbers(PairFeatures(source, target, kScale).tracks), ElementsAre(Pair(0, 0)))
      << "each is the only one";
}

TEST(PairFeatures, SplashesAndApexesFollowTheMergeBefore) {
  const Features source{{Drop({-20, 0, 10}, 10), Splash({-20, 3, 0}, 20)},
                        {Apex({-20, 0, 12, 25})}};
  const Features target{{Drop({15, 0, 40}, 25), Splash({15, 3, 0}, 35)}, {Apex({15, 0, 14, 41})}};
  const auto pairs = PairFeatures(source, target, kScale);
  EXPECT_THAT(Numbers(pairs.tracks), UnorderedElementsAre(Pair(0, 0), Pair(1, 1)));
  EXPECT_THAT(Numbers(pairs.extrema), ElementsAre(Pair(0, 0)));
  const Features alone{{}, target.extrema};
  EXPECT_THAT(PairFeatures(source, alone, kScale).extrema, IsEmpty()) << "nothing tells where";
}

TEST(PairFeatures, ExtremaKeepTheirOrderInTime) {
  // The second of the source comes first in the target: the surer pair stays.
  const Features source{{}, {Apex({0, 0, 12, 30}), Apex({30, 0, 12, 33})}};
  const Features target{{}, {Apex({0, 0, 12, 30}), Apex({31, 0, 12, 29})}};
  EXPECT_THAT(Numbers(PairFeatures(source, target, kScale).extrema), ElementsAre(Pair(0, 0)));
  // An apex after a merge does not belong to one before it.
  const Features after{{Drop({0, 0, 20}, 28)}, {Apex({0, 0, 12, 30})}};
  const Features before{{Drop({0, 0, 20}, 28)}, {Apex({0, 0, 12, 27})}};
  EXPECT_THAT(PairFeatures(after, before, kScale).extrema, IsEmpty());
  Extremum crater = Apex({0, 0, 12, 30});
  crater.kind = ExtremumKind::kCrater;
  EXPECT_THAT(PairFeatures(after, {{}, {crater}}, kScale).extrema, IsEmpty());
}

}  // namespace
}  // namespace liquidblend::registration::pair_features_test

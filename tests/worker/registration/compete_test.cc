#include "worker/registration/compete.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/worker/registration/drops_testing.h"

namespace liquidblend::registration {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

RegistrationOptions SmallOptions() {
  RegistrationOptions options;
  options.sample_share = 0.2;  // the meshes are small
  return options;
}

Competition CompetitionOf(const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target,
                          const RegistrationOptions& options = SmallOptions(),
                          int num_threads = 2) {
  auto competition = Compete(source, target, 1.0, {}, options, parallel::Arena(num_threads));
  EXPECT_TRUE(competition.ok()) << competition.status();
  return *std::move(competition);
}

TEST(WinnerOf, IsTheFirstUnlessAnotherCostsLessThanHalfAsMuch) {
  EXPECT_EQ(WinnerOf({4}), 0u);
  EXPECT_EQ(WinnerOf({4, 2.1, 3}), 0u);
  EXPECT_EQ(WinnerOf({4, 1.9, 1.8}), 2u);
  EXPECT_EQ(WinnerOf({std::numeric_limits<double>::infinity(), 9}), 1u);
}

// Without pairs the drop grabs the pool (automatic_blend_test.cc).
TEST(Compete, PairsThatKeepADropWholeWinAgainstNone) {
  const Competition competition =
      CompetitionOf(Scene({DropAt(-0.6, 0.7)}), Scene({DropAt(0.6, 0.7)}));
  EXPECT_EQ(competition.winner, Pairing::kFound);
  ASSERT_EQ(competition.hypotheses.size(), 2u);
  EXPECT_TRUE(competition.hypotheses[0].is_kept);
  EXPECT_FALSE(competition.hypotheses[1].is_kept);
  EXPECT_THAT(competition.hypotheses[1].pairing, HasSubstr("no pairs"));
  EXPECT_GT(competition.hypotheses[1].cost, 2 * competition.hypotheses[0].cost);
}

TEST(Compete, TwoDropsMayExchangeTheirPartners) {
  const Competition competition =
      CompetitionOf(Scene({DropAt(-0.9, 0.5), DropAt(0.1, 0.5)}, 1.4, 10),
                    Scene({DropAt(-0.1, 0.5), DropAt(0.9, 0.5)}, 1.4, 10));
  EXPECT_EQ(competition.winner, Pairing::kFound);
  ASSERT_EQ(competition.hypotheses.size(), 3u);
  EXPECT_THAT(competition.hypotheses[1].pairing, HasSubstr("exchange"));
}

TEST(Compete, HasTheSameBytesForAnyNumberOfThreads) {
  const mesh::SpaceTimeMesh source = Scene({DropAt(-0.6, 0.7)}), target = Scene({DropAt(0.6, 0.7)});
  const Competition one = CompetitionOf(source, target, SmallOptions(), 1);
  const Competition eight = CompetitionOf(source, target, SmallOptions(), 8);
  ASSERT_EQ(eight.hypotheses.size(), one.hypotheses.size());
  for (size_t n = 0; n < one.hypotheses.size(); ++n) {
    EXPECT_EQ(eight.hypotheses[n].cost, one.hypotheses[n].cost);
  }
}

TEST(Compete, WhereNothingIsFoundThereIsNoChoice) {
  EXPECT_THAT(CompetitionOf(Scene({}), Scene({})).hypotheses, IsEmpty());
}

TEST(Compete, ARegistrationThatIsNotAutomaticHasNoChoice) {
  RegistrationOptions options = SmallOptions();
  options.automatic_correspondences = false;
  const mesh::SpaceTimeMesh source = Scene({DropAt(-0.6, 0.7)});
  EXPECT_THAT(CompetitionOf(source, source, options).hypotheses, IsEmpty());
}

}  // namespace
}  // namespace liquidblend::registration

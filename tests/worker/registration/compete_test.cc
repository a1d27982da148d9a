#include "worker/registration/compete.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/worker/registration/drops_testing.h"
#include "worker/registration/register.h"

namespace liquidblend::registration {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

RegistrationOptions SmallOptions(Pairing pairing = Pairing::kFound) {
  RegistrationOptions options;
  options.sample_share = 0.2;  // the meshes are small
  options.pairing = pairing;
  return options;
}

// A drop that falls elsewhere. Without pairs it grabs the pool (automatic_blend_test.cc).
class CompeteTest : public ::testing::Test {
 protected:
  absl::StatusOr<Registration> RegisterBest(const RegistrationOptions& options, int num_threads = 2,
                                            const RegistrationHooks& hooks = {}) const {
    return RegisterWithBestPairing(left_, right_, {}, options, parallel::Arena(num_threads), hooks);
  }
  absl::StatusOr<Registration> RegisterOnce(Pairing pairing) const {
    return Register(left_, right_, {}, SmallOptions(pairing), parallel::Arena(2));
  }

  const mesh::SpaceTimeMesh left_ = Scene({DropAt(-0.6, 0.7)}), right_ = Scene({DropAt(0.6, 0.7)});
};

TEST(WinnerOf, IsTheFirstUnlessAnotherCostsLessThanHalfAsMuch) {
  EXPECT_EQ(WinnerOf({4}), 0u);
  EXPECT_EQ(WinnerOf({4, 2.1, 3}), 0u);
  EXPECT_EQ(WinnerOf({4, 1.9, 1.8}), 2u);
  EXPECT_EQ(WinnerOf({std::numeric_limits<double>::infinity(), 9}), 1u);
}

TEST(KeptPairing, IsTheFirstIfNoneOrAnUnknownOneWasKept) {
  EXPECT_EQ(KeptPairing({}, Pairing::kExchanged), Pairing::kExchanged);
  EXPECT_EQ(KeptPairing({{"no pairs of features", 1, true}}, Pairing::kFound), Pairing::kNone);
  EXPECT_EQ(KeptPairing({{"no pairs of features", 1, false}}, Pairing::kFound), Pairing::kFound);
  EXPECT_EQ(KeptPairing({{"by a later program", 1, true}}, Pairing::kFound), Pairing::kFound);
}

TEST_F(CompeteTest, PairsThatGiveAGoodRegistrationHaveNoRivals) {
  const auto once = RegisterOnce(Pairing::kFound);
  ASSERT_TRUE(once.ok()) << once.status();
  ASSERT_EQ(once->report.verdict.grade, mesh::Grade::kGood) << once->report.verdict.reason;
  const auto best = RegisterBest(SmallOptions());
  ASSERT_TRUE(best.ok()) << best.status();
  EXPECT_THAT(best->report.hypotheses, IsEmpty());
  EXPECT_EQ(best->displacement, once->displacement);
}

TEST_F(CompeteTest, PairsThatKeepADropWholeWinAgainstNone) {
  const auto best = RegisterBest(SmallOptions(Pairing::kNone));
  ASSERT_TRUE(best.ok()) << best.status();
  const std::vector<mesh::Hypothesis>& tried = best->report.hypotheses;
  ASSERT_EQ(tried.size(), 2u);
  EXPECT_THAT(tried[0].pairing, HasSubstr("no pairs"));
  EXPECT_FALSE(tried[0].is_kept);
  EXPECT_TRUE(tried[1].is_kept);
  EXPECT_GT(tried[0].cost, 2 * tried[1].cost);
  EXPECT_EQ(KeptPairing(tried, Pairing::kNone), Pairing::kFound);
  EXPECT_EQ(best->displacement, RegisterOnce(Pairing::kFound)->displacement);
}

TEST_F(CompeteTest, NothingElseIsTriedWithoutAutomaticCorrespondences) {
  RegistrationOptions options = SmallOptions();
  options.automatic_correspondences = false;
  const auto best = RegisterBest(options);
  ASSERT_TRUE(best.ok()) << best.status();
  ASSERT_NE(best->report.verdict.grade, mesh::Grade::kGood);
  EXPECT_THAT(best->report.hypotheses, IsEmpty());
}

TEST_F(CompeteTest, NothingElseIsTriedForAPreview) {
  RegistrationOptions options = SmallOptions(Pairing::kNone);
  options.max_iterations = 7;
  const auto best = RegisterBest(options);
  ASSERT_TRUE(best.ok()) << best.status();
  ASSERT_NE(best->report.verdict.grade, mesh::Grade::kGood);
  EXPECT_THAT(best->report.hypotheses, IsEmpty());
}

TEST_F(CompeteTest, CancellingEndsALaterTrial) {
  int num_last = 0;  // of iterations that were the last of a registration
  RegistrationHooks hooks;
  hooks.progress = [&](const IterationReport& report) {
    num_last += report.iteration == report.num_iterations;
    return num_last == 0 || report.iteration == report.num_iterations;
  };
  EXPECT_TRUE(absl::IsCancelled(RegisterBest(SmallOptions(Pairing::kNone), 2, hooks).status()));
  EXPECT_EQ(num_last, 1);
}

TEST_F(CompeteTest, HasTheSameBytesForAnyNumberOfThreads) {
  const auto one = RegisterBest(SmallOptions(Pairing::kNone), 1),
             eight = RegisterBest(SmallOptions(Pairing::kNone), 8);
  ASSERT_TRUE(one.ok() && eight.ok());
  EXPECT_EQ(one->displacement, eight->displacement);
  EXPECT_EQ(one->report.hypotheses[0].cost, eight->report.hypotheses[0].cost);
}

// Each drop is nearer to the other's partner.
TEST(Compete, PartnersThatWereExchangedWronglyAreExchangedBack) {
  const auto best =
      RegisterWithBestPairing(Scene({DropAt(-0.9, 0.5), DropAt(0.1, 0.5)}, 1.4, 10),
                              Scene({DropAt(-0.1, 0.5), DropAt(0.9, 0.5)}, 1.4, 10), {},
                              SmallOptions(Pairing::kExchanged), parallel::Arena(2));
  ASSERT_TRUE(best.ok()) << best.status();
  const std::vector<mesh::Hypothesis>& tried = best->report.hypotheses;
  ASSERT_EQ(tried.size(), 3u);
  EXPECT_THAT(tried[0].pairing, HasSubstr("exchange"));
  EXPECT_EQ(KeptPairing(tried, Pairing::kExchanged), Pairing::kFound);
}

}  // namespace
}  // namespace liquidblend::registration

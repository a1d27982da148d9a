#include "worker/jobs/previous_version.h"

#include <gtest/gtest.h>

#include "core/store/files/correspondence_records.h"

namespace liquidblend::jobs {
namespace {

mesh::Correspondence At(double x) {
  mesh::Correspondence correspondence;
  correspondence.source = {x, 0, 0, 0};
  correspondence.target = {x, 1, 0, 0};
  return correspondence;
}

// A family of two targets, each with a correspondence of a user's and an automatic one, and a job
// that refines it with the same ones of the user's.
class IsKeptTest : public ::testing::Test {
 protected:
  IsKeptTest() {
    family_.space_time_reports.resize(3);
    family_.targets.resize(2);
    for (int k = 0; k < 2; ++k) {
      auto& reports = family_.targets[k].report.correspondences;
      reports.push_back({.correspondence = At(k)});
      reports.push_back({.correspondence = At(10 + k), .automatic = true});
      job_.add_targets("target");
      Ask(k, At(k));
    }
  }

  void Ask(int k, const mesh::Correspondence& correspondence) {
    while (job_.correspondences_size() <= k) job_.add_correspondences();
    *job_.mutable_correspondences(k)->add_correspondences() =
        store::ToRecord(mesh::CorrespondenceReport{correspondence}, family_.frames_per_second)
            .correspondence();
  }

  mesh::RegisteredFamily family_;
  store::v1::RegisterJob job_;
};

TEST_F(IsKeptTest, NoneIfNoTargetHasNewCorrespondences) {
  EXPECT_FALSE(IsKept(job_, 0, family_));
  EXPECT_FALSE(IsKept(job_, 1, family_));
}

TEST_F(IsKeptTest, ATargetWithoutNewOnesWhateverAutomaticOnesItHas) {
  Ask(1, At(5));
  EXPECT_TRUE(IsKept(job_, 0, family_));
  EXPECT_FALSE(IsKept(job_, 1, family_));
}

TEST_F(IsKeptTest, NoneThatWouldLoseItsAutomaticOnes) {
  Ask(1, At(5));
  job_.mutable_options()->set_automatic_correspondences(false);
  EXPECT_FALSE(IsKept(job_, 0, family_));
  family_.targets[0].report.correspondences.pop_back();
  EXPECT_TRUE(IsKept(job_, 0, family_));
}

TEST_F(IsKeptTest, NoneOfAFamilyWithoutReportsOfItsMeshes) {
  Ask(1, At(5));
  family_.space_time_reports.clear();
  EXPECT_FALSE(IsKept(job_, 0, family_));
}

}  // namespace
}  // namespace liquidblend::jobs

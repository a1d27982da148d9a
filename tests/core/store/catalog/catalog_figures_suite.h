// CatalogSuite: figures of the jobs for operators. Included by catalog_suite.h.
#pragma once

#include <string>
#include <vector>

#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

TEST_P(CatalogSuite, CountsPausedJobsUntilTheirPauseIsOver) {
  MustSubmitImport("a");
  MustSubmitImport("b");
  EXPECT_EQ(catalog_->MeasureQueue(kAnyMemory)->num_paused, 0);
  FailNext(absl::UnavailableError("net"));
  EXPECT_EQ(catalog_->MeasureQueue(kAnyMemory)->num_paused, 1);
  now_ += absl::Seconds(1) - absl::Microseconds(1);
  EXPECT_EQ(catalog_->MeasureQueue(kAnyMemory)->num_paused, 1);
  now_ += absl::Microseconds(1);
  EXPECT_EQ(catalog_->MeasureQueue(kAnyMemory)->num_paused, 0);
}

// As they are given out then.
TEST_P(CatalogSuite, CountsNoPauseThatATurnedBackClockProlongs) {
  MustSubmitImport("a");
  FailNext(absl::UnavailableError("net"));
  now_ -= absl::Hours(1);
  EXPECT_EQ(catalog_->MeasureQueue(kAnyMemory)->num_paused, 0);
  EXPECT_EQ(catalog_->MeasureQueue(kAnyMemory)->oldest_wait, absl::ZeroDuration());
}

TEST_P(CatalogSuite, CountsQueuedJobsThatAreTooLarge) {
  MustSubmitOfMemory("running", 1000);
  MustLease();
  MustSubmitOfMemory("unknown", 0);
  MustSubmitOfMemory("fits", 999);
  MustSubmitOfMemory("large", 1000);
  MustSubmitOfMemory("largest", 1001);
  EXPECT_EQ(catalog_->MeasureQueue(999)->num_too_large, 2);
  EXPECT_EQ(catalog_->MeasureQueue(1000)->num_too_large, 1);
  EXPECT_EQ(catalog_->MeasureQueue(kAnyMemory)->num_too_large, 0);
}

TEST_P(CatalogSuite, MeasuresHowLongTheOldestQueuedJobWaits) {
  const auto wait = [&] { return catalog_->MeasureQueue(kAnyMemory)->oldest_wait; };
  EXPECT_EQ(wait(), absl::ZeroDuration());
  MustSubmitImport("a");
  now_ += absl::Seconds(5);
  MustSubmitImport("b");
  EXPECT_EQ(wait(), absl::Seconds(5));
  const Lease a = MustLease();  // b is the oldest one now
  now_ += absl::Seconds(7);
  EXPECT_EQ(wait(), absl::Seconds(7));
  ASSERT_THAT(catalog_->ReleaseJob(a.lease_id), Succeeds());
  now_ += absl::Seconds(3);
  EXPECT_EQ(wait(), absl::Seconds(3));  // since a was given back
  FailNext(absl::UnavailableError("net"));
  EXPECT_EQ(wait(), absl::Seconds(10));  // b: a is in its pause
}

TEST_P(CatalogSuite, ListsTheJobsThatHaveEnded) {
  const auto after = [&](absl::Time time, int max_jobs = 10) {
    std::vector<std::string> ids;
    const auto jobs = catalog_->ListEndedJobs(time, max_jobs);
    EXPECT_THAT(jobs, Succeeds());
    for (const Job& job : *jobs) ids.push_back(job.id());
    return ids;
  };
  const absl::Time start = now_;
  const Job published = MustSubmitImport("a");
  now_ += absl::Seconds(1);
  ASSERT_THAT(catalog_->PublishAnimation(MustLease().lease_id, AnimationCalled("a")), Succeeds());
  const Job failed = MustSubmitImport("b");
  now_ += absl::Seconds(1);
  FailNext(absl::DataLossError("torn"), /*retry=*/false);
  const Job cancelled = MustSubmitImport("c");
  now_ += absl::Seconds(1);
  ASSERT_THAT(catalog_->RequestCancel(cancelled.id()), Succeeds());
  MustSubmitImport("queued");
  using ::testing::ElementsAre;
  EXPECT_THAT(after(absl::InfinitePast()),
              ElementsAre(cancelled.id(), failed.id(), published.id()));
  EXPECT_THAT(after(absl::InfinitePast(), 1), ElementsAre(cancelled.id()));
  EXPECT_THAT(after(start + absl::Seconds(1)), ElementsAre(cancelled.id(), failed.id()));
  EXPECT_THAT(after(now_), ElementsAre());
}

TEST_P(CatalogSuite, ListsNoChildrenThatHaveEnded) {
  MustSubmitThreeTargets();
  const absl::Time before = now_;
  now_ += absl::Seconds(1);
  FinishNextChild();
  EXPECT_TRUE(catalog_->ListEndedJobs(before, 10)->empty());
}

}  // namespace liquidblend::store

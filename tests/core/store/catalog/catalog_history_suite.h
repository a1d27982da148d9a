// The part of the catalogs' suite about the history: how long jobs that have ended are kept.
// Included by catalog_suite.h.
#pragma once

#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

inline std::vector<std::string> IdsOf(const Page<pb::JobRecord>& page) {
  std::vector<std::string> ids;
  for (const pb::JobRecord& job : page.records) ids.push_back(job.id());
  return ids;
}

TEST_P(CatalogSuite, ForgetsJobsSomeTimeAfterTheirEnd) {
  const Job succeeded = MustSubmitImport("a", "request a");
  ASSERT_THAT(catalog_->PublishAnimation(MustLease().lease_id, AnimationCalled("a")), Succeeds());
  const Job failed = MustSubmitImport("b", "request b");
  FailNext(absl::DataLossError("torn"), /*retry=*/false);
  const Job cancelled = MustSubmitImport("c");
  ASSERT_THAT(catalog_->RequestCancel(cancelled.id()), Succeeds());
  now_ += absl::Hours(24);
  const Job later = MustSubmitImport("d");
  FailNext(absl::DataLossError("torn"), /*retry=*/false);

  EXPECT_EQ(*catalog_->PruneHistory({.keep = absl::Hours(24)}), 0);  // not a moment too early
  now_ += absl::Microseconds(1);
  EXPECT_EQ(*catalog_->PruneHistory({.keep = absl::ZeroDuration()}), 0);
  EXPECT_EQ(*catalog_->PruneHistory({.keep = absl::Hours(24), .dry_run = true}), 3);
  EXPECT_EQ(catalog_->ListJobs(0, "")->records.size(), 4);
  EXPECT_EQ(*catalog_->PruneHistory({.keep = absl::Hours(24)}), 3);
  EXPECT_THAT(IdsOf(*catalog_->ListJobs(0, "")), ElementsAre(later.id()));
  EXPECT_THAT(catalog_->GetJob(failed.id()), Fails(Code::kNotFound, failed.id()));
  EXPECT_EQ(GetAnimation("a").state(), Animation::READY);
  EXPECT_EQ(GetAnimation("b").state(), Animation::FAILED);
  EXPECT_EQ(GetAnimation("b").error().message(), "torn");
}

TEST_P(CatalogSuite, KnowsARequestAsLongAsItsJobIsKept) {
  const Job first = MustSubmitImport("b", "request b");
  FailNext(absl::DataLossError("torn"), /*retry=*/false);
  now_ += absl::Hours(1);
  EXPECT_EQ(*catalog_->PruneHistory({.keep = absl::Hours(2)}), 0);
  EXPECT_EQ(MustSubmitImport("b", "request b").id(), first.id());
  EXPECT_EQ(*catalog_->PruneHistory({.keep = absl::Minutes(30)}), 1);
  EXPECT_NE(MustSubmitImport("b", "request b").id(), first.id());
}

// A job of any age that has not ended, its children that have, and what they need.
TEST_P(CatalogSuite, ForgetsNothingOfJobsThatAreNotDone) {
  const Job registration = MustSubmitThreeTargets();
  FinishNextChild();
  const Lease lease = MustLease();
  ASSERT_THAT(catalog_->SaveCheckpoint(lease.lease_id, "checkpoint"), Succeeds());
  MustSubmitImport("queued");
  const std::vector<std::string> blobs = *catalog_->ListReferencedBlobs();
  now_ += absl::Hours(24 * 365);
  EXPECT_EQ(*catalog_->PruneHistory({}), 4);  // the imports of a, b, c and d
  EXPECT_EQ(catalog_->ListJobs(0, "")->records.size(), 2);
  EXPECT_EQ(ChildrenOf(registration).size(), 3);
  EXPECT_EQ(*catalog_->ListReferencedBlobs(), blobs);
  EXPECT_THAT(catalog_->Heartbeat(lease.lease_id, kLease, {}), Succeeds());
}

TEST_P(CatalogSuite, FamiliesKeepTheirVersionsWithoutTheirHistory) {
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  MakeFamily("f", "a", {"b"});
  now_ += absl::Hours(2);
  EXPECT_EQ(*catalog_->PruneHistory({.keep = absl::Hours(1)}), 3);
  EXPECT_EQ(catalog_->GetFamily("f")->blob(), "blob-of-f");
  EXPECT_THAT(*catalog_->ListReferencedBlobs(), ElementsAre("blob-of-a", "blob-of-b", "blob-of-f"));
  EXPECT_EQ(MakeFamily("f", "a", {"b"}), 2);
  EXPECT_THAT(catalog_->Inspect()->damage, IsEmpty());
}

TEST_P(CatalogSuite, OwnersTakeTurnsWithoutHistoryToo) {
  MustSubmitMany("many", 4);
  for (const std::string id : {"many1", "many2"}) {
    ASSERT_THAT(catalog_->PublishAnimation(MustLease().lease_id, AnimationCalled(id)), Succeeds());
  }
  now_ += absl::Hours(1);
  EXPECT_EQ(*catalog_->PruneHistory({.keep = absl::Minutes(30)}), 2);
  MustSubmitMany("few", 3);
  EXPECT_THAT(Next(4), ElementsAre("many3", "few1", "many4", "few2"));
}

TEST_P(CatalogSuite, PrunesManyJobsInSeveralSteps) {
  CatalogContents contents;
  for (int k = 0; k < 1201; ++k) {
    Job& job = contents.jobs.emplace_back(ImportOf(absl::StrCat("a", k)));
    job.set_id(absl::StrCat("import-", k));
    job.set_state(Job::SUCCEEDED);
    job.mutable_update_time()->set_seconds(1600000000 + k);
  }
  ASSERT_THAT(catalog_->Import(contents), Succeeds());
  int num_asked = 0;
  EXPECT_EQ(*catalog_->PruneHistory({.must_stop = [&] { return ++num_asked > 1; }}), 500);
  EXPECT_EQ(catalog_->ListJobs(1000, "")->records.back().id(),
            "import-500");  // the oldest go first
  EXPECT_EQ(*catalog_->PruneHistory({}), 701);
  EXPECT_THAT(catalog_->PruneHistory({.keep = -absl::Seconds(1)}),
              Fails(Code::kInvalidArgument, "keep = -1s"));
}

}  // namespace liquidblend::store

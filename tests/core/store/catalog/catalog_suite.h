// What every backend of Catalog must do. A backend's test includes this and instantiates
// CatalogSuite and CatalogVersions with a function that makes one CatalogBackend.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "core/store/catalog/catalog.h"
#include "tests/core/store/catalog/catalog_children_suite.h"
#include "tests/core/store/catalog/catalog_figures_suite.h"
#include "tests/core/store/catalog/catalog_history_suite.h"
#include "tests/core/store/catalog/catalog_memory_suite.h"
#include "tests/core/store/catalog/catalog_order_suite.h"
#include "tests/core/store/catalog/catalog_owners_suite.h"
#include "tests/core/store/catalog/catalog_pages_suite.h"
#include "tests/core/store/catalog/catalog_queue_suite.h"
#include "tests/core/store/catalog/catalog_retry_suite.h"
#include "tests/core/store/catalog/catalog_testing.h"
#include "tests/core/store/catalog/catalog_upkeep_suite.h"
#include "tests/core/store/catalog/catalog_uses_suite.h"
#include "tests/core/store/catalog/catalog_versions_suite.h"

namespace liquidblend::store {

// ---- accepting work

TEST_P(CatalogSuite, ShowsAnImportAndItsJobTogether) {
  const Job job = MustSubmitImport("drops");
  EXPECT_FALSE(job.id().empty());
  EXPECT_EQ(job.state(), Job::QUEUED);
  EXPECT_EQ(job.create_time().seconds(), 1700000000);
  EXPECT_EQ(job.create_time().nanos(), 250000);
  EXPECT_EQ(GetJob(job.id()).SerializeAsString(), job.SerializeAsString());
  EXPECT_EQ(GetAnimation("drops").state(), Animation::IMPORTING);
  EXPECT_EQ(GetAnimation("drops").create_time().seconds(), 1700000000);
}

TEST_P(CatalogSuite, RefusesAnAnimationThatExists) {
  MustSubmitImport("drops");
  EXPECT_THAT(catalog_->SubmitImport(AnimationCalled("drops"), ImportOf("drops")),
              Fails(Code::kAlreadyExists, "'drops'"));
  EXPECT_EQ(catalog_->ListJobs(0, "")->records.size(), 1);
}

TEST_P(CatalogSuite, ReplacesAnAnimationWhoseImportFailed) {
  MustSubmitImport("drops");
  EXPECT_THAT(catalog_->FailJob(MustLease().lease_id, absl::DataLossError("frame 3"), false),
              Succeeds());
  EXPECT_EQ(GetAnimation("drops").state(), Animation::FAILED);
  MustSubmitImport("drops");
  EXPECT_EQ(GetAnimation("drops").state(), Animation::IMPORTING);
  EXPECT_FALSE(GetAnimation("drops").has_error());
}

TEST_P(CatalogSuite, AnswersARepeatedRequestWithItsFirstJob) {
  MakeAnimation("drops2");
  const Job job = MustSubmitImport("drops", "request 1");
  EXPECT_EQ(MustSubmitImport("drops", "request 1").SerializeAsString(), job.SerializeAsString());
  EXPECT_THAT(catalog_->SubmitImport(AnimationCalled("pool"), ImportOf("pool", "request 1")),
              Fails(Code::kInvalidArgument, "'request 1'"));
  EXPECT_THAT(catalog_->GetAnimation("pool"), Fails(Code::kNotFound, "'pool'"));
  const auto one = catalog_->SubmitRegistration(RegistrationOf("f", "drops2", {"drops2"}, "r2"));
  const auto two = catalog_->SubmitRegistration(RegistrationOf("f", "drops2", {"drops2"}, "r2"));
  ASSERT_THAT(one, Succeeds());
  ASSERT_THAT(two, Succeeds());
  EXPECT_EQ(one->id(), two->id());
}

TEST_P(CatalogSuite, RefusesJobsThatContradictThemselves) {
  EXPECT_THAT(catalog_->SubmitImport(AnimationCalled("drops"), ImportOf("pool")),
              Fails(Code::kInvalidArgument, "'drops'"));
  EXPECT_THAT(catalog_->SubmitImport(AnimationCalled(""), ImportOf("")),
              Fails(Code::kInvalidArgument, "id"));
  EXPECT_THAT(catalog_->SubmitRegistration(ImportOf("drops")),
              Fails(Code::kInvalidArgument, "registration"));
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("f", "a", {})),
              Fails(Code::kInvalidArgument, "targets"));
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("", "a", {"b"})),
              Fails(Code::kInvalidArgument, "id"));
  EXPECT_TRUE(NothingToDo());
}

TEST_P(CatalogSuite, RefusesStringsThatAreNotUtf8) {
  Job job = ImportOf("drops");
  job.mutable_import_animation()->mutable_files(0)->set_name("\xff.ply");
  EXPECT_THAT(catalog_->SubmitImport(AnimationCalled("drops"), job),
              Fails(Code::kInvalidArgument, "UTF-8"));
  EXPECT_THAT(catalog_->GetAnimation("drops"), Fails(Code::kNotFound, "'drops'"));
}

TEST_P(CatalogSuite, RegistersReadyAnimationsOnly) {
  MakeAnimation("a");
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("f", "a", {"b"})),
              Fails(Code::kNotFound, "animation 'b'"));
  MustSubmitImport("b");
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("f", "b", {"a"})),
              Fails(Code::kFailedPrecondition, "animation 'b' is not ready"));
  EXPECT_THAT(catalog_->FailJob(MustLease().lease_id, absl::DataLossError("bad"), false),
              Succeeds());
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("f", "a", {"b"})),
              Fails(Code::kFailedPrecondition, "animation 'b' is not ready: its import failed"));
  EXPECT_THAT(catalog_->GetFamily("f"), Fails(Code::kNotFound, "family 'f'"));
  EXPECT_TRUE(NothingToDo());
}

TEST_P(CatalogSuite, RegistersAFamilyOneJobAtATime) {
  MakeAnimation("a");
  const Job job = MustSubmitRegistration("f", "a", {"a"});
  EXPECT_EQ(catalog_->GetFamily("f")->version(), 0);
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("f", "a", {"a"})),
              Fails(Code::kFailedPrecondition, job.id()));
  MustLease();
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("f", "a", {"a"})),
              Fails(Code::kFailedPrecondition, job.id()));
  MustSubmitRegistration("g", "a", {"a"});
}

// ---- reading

TEST_P(CatalogSuite, SaysWhatIsMissing) {
  EXPECT_THAT(catalog_->GetAnimation("x"), Fails(Code::kNotFound, "animation 'x'"));
  EXPECT_THAT(catalog_->GetFamily("x"), Fails(Code::kNotFound, "family 'x'"));
  EXPECT_THAT(catalog_->GetJob("x"), Fails(Code::kNotFound, "job 'x'"));
  EXPECT_THAT(catalog_->DeleteAnimation("x"), Fails(Code::kNotFound, "animation 'x'"));
  EXPECT_THAT(catalog_->DeleteFamily("x"), Fails(Code::kNotFound, "family 'x'"));
  EXPECT_THAT(catalog_->DeleteJob("x"), Fails(Code::kNotFound, "job 'x'"));
  EXPECT_THAT(catalog_->RequestCancel("x"), Fails(Code::kNotFound, "job 'x'"));
}

TEST_P(CatalogSuite, PagesThroughListsInOrder) {
  std::vector<std::string> jobs;
  for (const std::string id : {"d", "b", "e", "a", "c"}) {
    jobs.insert(jobs.begin(), MustSubmitImport(id).id());
  }
  std::vector<std::string> seen;
  std::string token;
  do {
    const auto page = catalog_->ListAnimations(2, token);
    ASSERT_THAT(page, Succeeds());
    ASSERT_LE(page->records.size(), 2);
    for (const Animation& animation : page->records) seen.push_back(animation.id());
    token = page->next_page_token;
  } while (!token.empty());
  EXPECT_THAT(seen, ::testing::ElementsAre("a", "b", "c", "d", "e"));
  seen.clear();
  do {
    const auto page = catalog_->ListJobs(2, token);
    ASSERT_THAT(page, Succeeds());
    for (const Job& job : page->records) seen.push_back(job.id());
    token = page->next_page_token;
    if (seen.size() == 2) MustSubmitImport("new");  // is not on the pages that follow
  } while (!token.empty());
  EXPECT_EQ(seen, jobs);
}

TEST_P(CatalogSuite, EndsWithAFullPage) {
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  MakeFamily("f", "a", {"b"});
  EXPECT_EQ(catalog_->ListAnimations(2, "")->next_page_token, "");
  EXPECT_EQ(catalog_->ListAnimations(0, "")->records.size(), 2);
  EXPECT_EQ(catalog_->ListAnimations(-1, "")->records.size(), 2);
  EXPECT_EQ(catalog_->ListFamilies(1, "")->records.at(0).id(), "f");
  EXPECT_EQ(catalog_->ListFamilies(1, "")->next_page_token, "");
}

TEST_P(CatalogSuite, RefusesPageTokensFromElsewhere) {
  for (const std::string id : {"a", "b"}) MustSubmitImport(id);
  const std::string token = catalog_->ListAnimations(1, "")->next_page_token;
  ASSERT_NE(token, "");
  EXPECT_THAT(catalog_->ListJobs(1, token), Fails(Code::kInvalidArgument, "page token"));
  EXPECT_THAT(catalog_->ListFamilies(1, token), Fails(Code::kInvalidArgument, "page token"));
  EXPECT_THAT(catalog_->ListAnimations(1, "\xff#"), Fails(Code::kInvalidArgument, "page token"));
  EXPECT_THAT(catalog_->ListAnimations(1, "b"), Fails(Code::kInvalidArgument, "page token"));
}

TEST_P(CatalogSuite, ListsTheBlobsThatAreNeeded) {
  EXPECT_TRUE(catalog_->ListReferencedBlobs()->empty());
  MustSubmitImport("a");
  EXPECT_THAT(*catalog_->ListReferencedBlobs(), ::testing::ElementsAre("upload-of-a"));
  EXPECT_THAT(catalog_->FailJob(MustLease().lease_id, absl::DataLossError("bad"), false),
              Succeeds());
  EXPECT_TRUE(catalog_->ListReferencedBlobs()->empty());
  MakeAnimation("b");
  MakeFamily("f", "b", {"b"});
  MustSubmitImport("c");
  MustLease();
  EXPECT_THAT(*catalog_->ListReferencedBlobs(),
              ::testing::ElementsAre("blob-of-b", "blob-of-f", "upload-of-c"));
}

// ---- publishing

TEST_P(CatalogSuite, PublishesAnImport) {
  const Job job = MustSubmitImport("drops");
  now_ += absl::Seconds(7);
  Animation animation = AnimationCalled("drops");
  animation.set_blob("blob");
  animation.mutable_manifest()->set_num_frames(72);
  EXPECT_THAT(catalog_->PublishAnimation(MustLease().lease_id, animation), Succeeds());
  EXPECT_EQ(GetAnimation("drops").state(), Animation::READY);
  EXPECT_EQ(GetAnimation("drops").blob(), "blob");
  EXPECT_EQ(GetAnimation("drops").manifest().num_frames(), 72);
  EXPECT_EQ(GetAnimation("drops").create_time().seconds(), 1700000000);
  EXPECT_EQ(GetJob(job.id()).state(), Job::SUCCEEDED);
  EXPECT_EQ(GetJob(job.id()).progress().fraction(), 1.0);
  EXPECT_EQ(GetJob(job.id()).update_time().seconds(), 1700000007);
  EXPECT_TRUE(NothingToDo());
}

TEST_P(CatalogSuite, CountsTheVersionsOfAFamily) {
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  EXPECT_EQ(MakeFamily("f", "a", {"b"}), 1);
  EXPECT_EQ(MakeFamily("g", "a", {"b"}), 1);
  now_ += absl::Seconds(7);
  EXPECT_EQ(MakeFamily("f", "a", {"b"}), 2);
  const auto family = catalog_->GetFamily("f");
  ASSERT_THAT(family, Succeeds());
  EXPECT_EQ(family->version(), 2);
  EXPECT_EQ(family->manifest().version(), 2);
  EXPECT_EQ(family->create_time().seconds(), 1700000000);
  EXPECT_EQ(family->update_time().seconds(), 1700000007);
}

TEST_P(CatalogSuite, NeverGivesAVersionTwice) {
  MakeAnimation("a");
  EXPECT_EQ(MakeFamily("f", "a", {"a"}), 1);
  EXPECT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  EXPECT_EQ(MakeFamily("f", "a", {"a"}), 2);
}

TEST_P(CatalogSuite, KeepsTheOldVersionWhileTheNextOneIsMade) {
  MakeAnimation("a");
  MakeFamily("f", "a", {"a"});
  MustSubmitRegistration("f", "a", {"a"});
  EXPECT_EQ(catalog_->GetFamily("f")->version(), 1);
  EXPECT_THAT(catalog_->FailJob(MustLease().lease_id, absl::InternalError("no"), false),
              Succeeds());
  EXPECT_EQ(catalog_->GetFamily("f")->version(), 1);
  EXPECT_EQ(catalog_->GetFamily("f")->blob(), "blob-of-f");
}

TEST_P(CatalogSuite, RefusesTheResultOfAnotherJob) {
  MakeAnimation("a");
  MustSubmitImport("b");
  const Lease import = MustLease();
  EXPECT_THAT(catalog_->PublishAnimation(import.lease_id, AnimationCalled("a")),
              Fails(Code::kInvalidArgument, "'a'"));
  EXPECT_THAT(catalog_->PublishFamily(import.lease_id, pb::FamilyRecord()),
              Fails(Code::kInvalidArgument, import.job.id()));
  EXPECT_EQ(GetJob(import.job.id()).state(), Job::RUNNING);
  EXPECT_EQ(GetAnimation("b").state(), Animation::IMPORTING);
}

// ---- removing

TEST_P(CatalogSuite, KeepsAnimationsThatAreNeeded) {
  for (const std::string id : {"a", "b", "c"}) MakeAnimation(id);
  const Job import = MustSubmitImport("d");
  EXPECT_THAT(catalog_->DeleteAnimation("d"), Fails(Code::kFailedPrecondition, import.id()));
  EXPECT_THAT(catalog_->ReleaseJob(MustLease().lease_id), Succeeds());
  EXPECT_THAT(catalog_->RequestCancel(import.id()), Succeeds());
  EXPECT_THAT(catalog_->DeleteAnimation("d"), Succeeds());
  const Job registration = MustSubmitRegistration("f", "a", {"b"});
  EXPECT_THAT(catalog_->DeleteAnimation("a"), Fails(Code::kFailedPrecondition, registration.id()));
  EXPECT_THAT(catalog_->DeleteAnimation("b"), Fails(Code::kFailedPrecondition, registration.id()));
  pb::FamilyRecord family;
  family.set_id("f");
  EXPECT_THAT(catalog_->PublishFamily(MustLease().lease_id, family), Succeeds());
  EXPECT_THAT(catalog_->DeleteAnimation("a"), Fails(Code::kFailedPrecondition, "family 'f'"));
  EXPECT_THAT(catalog_->DeleteAnimation("b"), Fails(Code::kFailedPrecondition, "family 'f'"));
  EXPECT_THAT(catalog_->DeleteAnimation("c"), Succeeds());
  MakeFamily("f", "a", {"a"});  // b is not part of it any more
  EXPECT_THAT(catalog_->DeleteAnimation("b"), Succeeds());
  EXPECT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  EXPECT_THAT(catalog_->DeleteAnimation("a"), Succeeds());
  EXPECT_TRUE(catalog_->ListAnimations(0, "")->records.empty());
}

TEST_P(CatalogSuite, KeepsFamiliesAndJobsThatAreWorkedOn) {
  MakeAnimation("a");
  MakeFamily("f", "a", {"a"});
  const Job job = MustSubmitRegistration("f", "a", {"a"});
  EXPECT_THAT(catalog_->DeleteFamily("f"), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_THAT(catalog_->DeleteJob(job.id()), Fails(Code::kFailedPrecondition, job.id()));
  const Lease lease = MustLease();
  EXPECT_THAT(catalog_->DeleteFamily("f"), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_THAT(catalog_->DeleteJob(job.id()), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_THAT(catalog_->FailJob(lease.lease_id, absl::InternalError("no"), false), Succeeds());
  EXPECT_THAT(catalog_->DeleteJob(job.id()), Succeeds());
  EXPECT_THAT(catalog_->GetJob(job.id()), Fails(Code::kNotFound, job.id()));
  EXPECT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  EXPECT_THAT(catalog_->GetFamily("f"), Fails(Code::kNotFound, "'f'"));
}

}  // namespace liquidblend::store

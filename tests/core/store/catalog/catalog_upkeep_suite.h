// The part of the catalogs' suite about keeping them: inspection, import, unreadable animations.
// Included by catalog_suite.h.
#pragma once

#include "absl/time/time.h"
#include "core/store/catalog/job_records.h"
#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

TEST_P(CatalogSuite, HasAnIdForEver) {
  const auto id = catalog_->Id();
  ASSERT_THAT(id, Succeeds());
  EXPECT_EQ(id->size(), 32);
  EXPECT_EQ(*backend_->Open(Options())->Id(), *id);
}

TEST_P(CatalogSuite, TellsTheVersionsOfItsFamilies) {
  EXPECT_THAT(*catalog_->ListFamilyVersions(), IsEmpty());
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  MakeFamily("f", "a", {"b"});
  MustSubmitRegistration("g", "a", {"b"});
  EXPECT_THAT(*catalog_->ListFamilyVersions(), ElementsAre(Pair("f", 1), Pair("g", 0)));
  pb::FamilyRecord family;
  family.set_id("g");
  ASSERT_THAT(catalog_->PublishFamily(MustLease().lease_id, family), Succeeds());
  MakeFamily("f", "a", {"b"});
  EXPECT_THAT(*catalog_->ListFamilyVersions(), ElementsAre(Pair("f", 2), Pair("g", 1)));
  ASSERT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  EXPECT_THAT(*catalog_->ListFamilyVersions(), ElementsAre(Pair("g", 1)));
}

TEST_P(CatalogSuite, TellsWhoHoldsWhichJobAndUntilWhen) {
  MustSubmitThreeTargets();
  const Lease lease = MustLease("w1");
  const absl::Time taken = now_;
  now_ += absl::Seconds(5);
  ASSERT_THAT(catalog_->Heartbeat(lease.lease_id, kLease, {}), Succeeds());
  const auto jobs = catalog_->ListUnfinishedJobs();
  ASSERT_THAT(jobs, Succeeds());
  ASSERT_EQ(jobs->size(), 4);  // the finished imports are not among them
  EXPECT_EQ((*jobs)[0].job.state(), Job::WAITING);
  const HeldJob& held = (*jobs)[1];
  EXPECT_EQ(held.job.id(), lease.job.id());
  EXPECT_EQ(held.job.worker(), "w1");
  EXPECT_EQ(held.lease_expires, now_ + kLease);
  EXPECT_EQ(held.job.start_time().seconds(), absl::ToUnixSeconds(taken));
  EXPECT_EQ(held.job.update_time().seconds(), absl::ToUnixSeconds(now_));
  EXPECT_EQ((*jobs)[2].job.state(), Job::QUEUED);
  EXPECT_EQ((*jobs)[2].lease_expires, absl::InfinitePast());
  ASSERT_THAT(catalog_->ReleaseJob(lease.lease_id), Succeeds());
  EXPECT_FALSE((*catalog_->ListUnfinishedJobs())[1].job.has_start_time());
}

// What lists of records look like to people; equal for equal catalogs.
inline std::string Describe(const CatalogContents& contents) {
  std::string text;
  for (const auto& record : contents.animations) text += record.DebugString();
  for (const auto& record : contents.families) text += record.DebugString();
  for (const auto& record : contents.members) text += record.DebugString();
  for (const auto& record : contents.versions) text += record.DebugString();
  for (const auto& record : contents.jobs) text += record.DebugString();
  return text;
}

TEST_P(CatalogSuite, IsTheSameAfterAnImportOfAllItHolds) {
  for (const std::string id : {"x", "y"}) MakeAnimation(id);
  MakeFamily("old", "x", {"y"});
  ASSERT_THAT(catalog_->DeleteFamily("old"), Succeeds());
  MustSubmitThreeTargets();
  FinishNextChild();
  MustSubmitImport("e", "request");
  const auto inspection = catalog_->Inspect();
  ASSERT_THAT(inspection, Succeeds());
  EXPECT_THAT(inspection->damage, IsEmpty());
  EXPECT_EQ(inspection->contents.versions.size(), 1);

  const std::unique_ptr<CatalogBackend> other_backend = GetParam()();
  const std::unique_ptr<Catalog> other = other_backend->Open(Options());
  EXPECT_EQ(inspection->blobs, *catalog_->ListReferencedBlobs());
  EXPECT_THAT(other->CheckImport(inspection->contents), Succeeds());
  ASSERT_THAT(other->Import(inspection->contents), Succeeds());
  EXPECT_EQ(Describe(other->Inspect()->contents), Describe(inspection->contents));
  EXPECT_EQ(*other->ListReferencedBlobs(), *catalog_->ListReferencedBlobs());
  // The work goes on there: the next child, and the family of a name that was used before.
  const auto lease = other->LeaseJob("w", kLease);
  ASSERT_THAT(lease, Succeeds());
  EXPECT_EQ((*lease)->job.register_target().target_index(), 1);
  EXPECT_THAT(other->SubmitImport(AnimationCalled("e"), ImportOf("e", "request")), Succeeds());
}

TEST_P(CatalogSuite, ImportsNothingIfAnyNameIsTaken) {
  MakeAnimation("a");
  MakeAnimation("b");
  MakeFamily("f", "a", {"b"});
  const CatalogContents all = catalog_->Inspect()->contents;
  const std::string before = Describe(all);
  CatalogContents clash;
  clash.animations = {AnimationCalled("x"), AnimationCalled("b")};
  EXPECT_THAT(catalog_->Import(clash), Fails(Code::kAlreadyExists, "animation 'b'"));
  EXPECT_THAT(catalog_->CheckImport(clash), Fails(Code::kAlreadyExists, "animation 'b'"));
  clash.animations.pop_back();
  clash.families.emplace_back().set_id("f");
  EXPECT_THAT(catalog_->Import(clash), Fails(Code::kAlreadyExists, "family"));
  clash.families.clear();
  clash.jobs = {all.jobs.back()};
  EXPECT_THAT(catalog_->Import(clash), Fails(Code::kAlreadyExists, all.jobs.back().id()));
  clash.jobs = {ImportOf("x", "one"), ImportOf("x", "one")};
  clash.jobs[0].set_id("1");
  clash.jobs[1].set_id("2");
  EXPECT_THAT(catalog_->Import(clash), Fails(Code::kAlreadyExists, "request_id 'one'"));
  EXPECT_EQ(Describe(catalog_->Inspect()->contents), before);
}

TEST_P(CatalogSuite, ADeletedFamilysVersionsAreNotGivenToAnImportedOne) {
  MakeAnimation("a");
  MakeAnimation("b");
  MakeFamily("f", "a", {"b"});
  ASSERT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  CatalogContents contents;
  contents.families.emplace_back().set_id("f");
  EXPECT_THAT(catalog_->Import(contents), Fails(Code::kAlreadyExists, "'f'"));
  contents = {};
  contents.versions.emplace_back().set_family("f");
  contents.versions.back().set_last_version(7);
  contents.versions.emplace_back().set_family("g");
  contents.versions.back().set_last_version(3);
  ASSERT_THAT(catalog_->Import(contents), Succeeds());
  EXPECT_EQ(MakeFamily("f", "a", {"b"}), 8);
  EXPECT_EQ(MakeFamily("g", "a", {"b"}), 4);
}

TEST_P(CatalogSuite, AnAnimationIsFailedWhileItsFileCannotBeRead) {
  MakeAnimation("a");
  const absl::Status lost = absl::DataLossError("blob blob-of-a is damaged");
  ASSERT_THAT(catalog_->SetAnimationReadable("a", "another blob", lost), Succeeds());
  EXPECT_EQ(GetAnimation("a").state(), Animation::READY);
  ASSERT_THAT(catalog_->SetAnimationReadable("a", "blob-of-a", lost), Succeeds());
  EXPECT_EQ(GetAnimation("a").state(), Animation::FAILED);
  EXPECT_EQ(GetAnimation("a").error().message(), lost.message());
  EXPECT_THAT(*catalog_->ListReferencedBlobs(), ElementsAre("blob-of-a"));
  ASSERT_THAT(catalog_->SetAnimationReadable("a", "blob-of-a", absl::OkStatus()), Succeeds());
  EXPECT_EQ(GetAnimation("a").state(), Animation::READY);
  EXPECT_FALSE(GetAnimation("a").has_error());
  // Meanwhile it may be imported again.
  ASSERT_THAT(catalog_->SetAnimationReadable("a", "blob-of-a", lost), Succeeds());
  MakeAnimation("a");
  EXPECT_EQ(GetAnimation("a").state(), Animation::READY);
  EXPECT_THAT(catalog_->SetAnimationReadable("b", "", lost), Fails(Code::kNotFound, "'b'"));
}

}  // namespace liquidblend::store

// The part of the catalogs' suite about versions of families that are kept beside the published
// one. Included by catalog_suite.h.
#pragma once

#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

using ::testing::Contains;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

class CatalogVersions : public CatalogSuite {
 protected:
  CatalogVersions() {
    for (const std::string id : {"a", "b", "c"}) MakeAnimation(id);
  }

  // Registers a and the target as family f, and publishes that with this blob.
  int64_t Publish(const std::string& target, const std::string& blob, int keep_versions = 2) {
    Job job = RegistrationOf("f", "a", {target});
    job.mutable_register_family()->set_keep_versions(keep_versions);
    job.set_owner("ann");
    EXPECT_THAT(catalog_->SubmitRegistration(job), Succeeds());
    pb::FamilyRecord family;
    family.set_id("f");
    family.set_blob(blob);
    family.set_size_bytes(100);
    family.mutable_manifest()->set_source("a");
    family.mutable_manifest()->add_targets(target);
    now_ += absl::Seconds(1);
    const auto version = catalog_->PublishFamily(MustLease().lease_id, family);
    EXPECT_THAT(version, Succeeds());
    return version.value_or(0);
  }

  std::vector<int64_t> KeptVersions() {
    std::vector<int64_t> numbers;
    const auto kept = catalog_->ListKeptVersions("f");
    EXPECT_THAT(kept, Succeeds());
    for (const pb::FamilyRecord& record : *kept) numbers.push_back(record.version());
    return numbers;
  }

  std::string BlobOf(int64_t version) {
    const auto record = catalog_->GetFamilyVersion("f", version);
    EXPECT_THAT(record, Succeeds());
    return record.ok() ? record->blob() : "";
  }

  int64_t StoredBytes() { return catalog_->ListOwners()->back().stored_bytes; }
};

TEST_P(CatalogVersions, AsManyAreKeptAsTheJobSays) {
  EXPECT_EQ(Publish("b", "blob 1", 3), 1);
  EXPECT_THAT(KeptVersions(), IsEmpty());
  EXPECT_EQ(Publish("b", "blob 2", 3), 2);
  EXPECT_EQ(Publish("c", "blob 3", 3), 3);
  EXPECT_THAT(KeptVersions(), ElementsAre(2, 1));
  EXPECT_EQ(Publish("c", "blob 4", 3), 4);
  EXPECT_THAT(KeptVersions(), ElementsAre(3, 2));
  EXPECT_THAT(*catalog_->ListKeptNumbers(), ElementsAre(Pair("f", UnorderedElementsAre(2, 3))));
  EXPECT_EQ(BlobOf(2), "blob 2");
  EXPECT_EQ(BlobOf(4), "blob 4");
  EXPECT_THAT(catalog_->GetFamilyVersion("f", 1),
              Fails(Code::kNotFound,
                    "family 'f' has no version 1; the published one is 4, and kept "
                    "are 3, 2"));
  EXPECT_EQ(catalog_->GetFamily("f")->version(), 4);
  EXPECT_EQ(Publish("c", "blob 5", 0), 5);  // as older servers order it
  EXPECT_THAT(KeptVersions(), IsEmpty());
}

TEST_P(CatalogVersions, TheirBlobsAreNeededAndCountForTheirOwner) {
  Publish("b", "blob 1");
  Publish("b", "blob 2");
  EXPECT_EQ(StoredBytes(), 200);
  Publish("b", "blob 3");
  EXPECT_EQ(StoredBytes(), 200);
  const auto blobs = *catalog_->ListReferencedBlobs();
  EXPECT_THAT(blobs, Contains("blob 2"));
  EXPECT_THAT(blobs, Contains("blob 3"));
  EXPECT_THAT(blobs, Not(Contains("blob 1")));
}

TEST_P(CatalogVersions, TheirAnimationsAreNeeded) {
  Publish("b", "blob 1");
  Publish("c", "blob 2");
  EXPECT_THAT(catalog_->DeleteAnimation("b"), Fails(Code::kFailedPrecondition, "family 'f'"));
  Publish("c", "blob 3");
  EXPECT_THAT(catalog_->DeleteAnimation("b"), Succeeds());
}

TEST_P(CatalogVersions, ARollbackPublishesOneAgainUnderANewNumber) {
  Publish("b", "blob 1");
  Publish("c", "blob 2");
  const auto back = catalog_->RollbackFamily("f", 1, 2);
  ASSERT_THAT(back, Succeeds());
  EXPECT_EQ(back->version(), 3);
  EXPECT_EQ(back->manifest().version(), 3);
  EXPECT_EQ(back->restored_version(), 1);
  EXPECT_EQ(back->blob(), "blob 1");
  EXPECT_EQ(catalog_->GetFamily("f")->DebugString(), back->DebugString());
  EXPECT_THAT(KeptVersions(), ElementsAre(2));
  EXPECT_THAT(catalog_->DeleteAnimation("b"), Fails(Code::kFailedPrecondition, "family 'f'"));
  EXPECT_EQ(catalog_->RollbackFamily("f", 1, 2)->version(), 3) << "that was done";
  EXPECT_EQ(catalog_->RollbackFamily("f", 2, 2)->version(), 4);
  EXPECT_EQ(Publish("b", "blob 5"), 5);
  EXPECT_EQ(catalog_->GetFamily("f")->restored_version(), 0);
}

TEST_P(CatalogVersions, ARollbackThatMeansNothingIsRefused) {
  EXPECT_THAT(catalog_->RollbackFamily("f", 1, 2), Fails(Code::kNotFound, "'f'"));
  Publish("b", "blob 1");
  EXPECT_THAT(catalog_->RollbackFamily("f", 1, 2),
              Fails(Code::kFailedPrecondition, "version 1 of family 'f' is the published one"));
  EXPECT_THAT(catalog_->RollbackFamily("f", 7, 2),
              Fails(Code::kNotFound, "has no version 7; the published one is 1, and no other"));
  EXPECT_THAT(catalog_->RollbackFamily("f", 0, 2), Fails(Code::kNotFound, "no version 0"));
  Publish("c", "blob 2");
  const Job job = MustSubmitRegistration("f", "a", {"b"});
  EXPECT_THAT(catalog_->RollbackFamily("f", 1, 2), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_EQ(catalog_->GetFamily("f")->version(), 2);
}

TEST_P(CatalogVersions, AreDeletedWithTheirFamily) {
  Publish("b", "blob 1");
  Publish("c", "blob 2");
  ASSERT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  EXPECT_THAT(KeptVersions(), IsEmpty());
  EXPECT_THAT(*catalog_->ListKeptNumbers(), IsEmpty());
  EXPECT_THAT(catalog_->GetFamilyVersion("f", 1), Fails(Code::kNotFound, "'f'"));
  EXPECT_THAT(*catalog_->ListReferencedBlobs(), Not(Contains("blob 1")));
  EXPECT_THAT(catalog_->DeleteAnimation("b"), Succeeds());
  EXPECT_EQ(Publish("c", "blob 3"), 3);
}

TEST_P(CatalogVersions, GoWithAnImportOfAll) {
  Publish("b", "blob 1");
  Publish("c", "blob 2");
  const auto inspection = catalog_->Inspect();
  ASSERT_THAT(inspection, Succeeds());
  EXPECT_THAT(inspection->damage, IsEmpty());
  ASSERT_EQ(inspection->contents.kept_versions.size(), 1);
  EXPECT_THAT(inspection->blobs, Contains("blob 1"));
  const std::unique_ptr<CatalogBackend> other_backend = GetParam()();
  const std::unique_ptr<Catalog> other = other_backend->Open(Options());
  ASSERT_THAT(other->Import(inspection->contents), Succeeds());
  EXPECT_EQ(other->Inspect()->contents.kept_versions[0].DebugString(),
            inspection->contents.kept_versions[0].DebugString());
  EXPECT_EQ(other->RollbackFamily("f", 1, 2)->blob(), "blob 1");
}

TEST_P(CatalogSuite, AFamilyThatIsToBeNewMustNotHaveAVersion) {
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  Job job = RegistrationOf("f", "a", {"b"});
  job.mutable_register_family()->set_must_be_new(true);
  job.set_request_id("first");
  const auto first = catalog_->SubmitRegistration(job);
  ASSERT_THAT(first, Succeeds());
  FailNext(absl::InvalidArgumentError("no"), /*retry=*/false);
  job.set_request_id("second");
  ASSERT_THAT(catalog_->SubmitRegistration(job), Succeeds()) << "it has no version yet";
  pb::FamilyRecord family;
  family.set_id("f");
  ASSERT_THAT(catalog_->PublishFamily(MustLease().lease_id, family), Succeeds());
  EXPECT_EQ(catalog_->SubmitRegistration(job)->request_id(), "second") << "the same request";
  job.set_request_id("third");
  EXPECT_THAT(catalog_->SubmitRegistration(job),
              Fails(Code::kAlreadyExists, "family 'f' exists already, in version 1"));
}

TEST_P(CatalogSuite, AFamilyTellsOfItsNewestRegistrationIfThatFailed) {
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  const Job first = MustSubmitRegistration("f", "a", {"b"});
  EXPECT_FALSE(catalog_->GetFamily("f")->has_failed_registration());
  now_ += absl::Seconds(1);
  FailNext(absl::InvalidArgumentError("no liquid"), /*retry=*/false);
  const pb::FailedRegistration failed = catalog_->GetFamily("f")->failed_registration();
  EXPECT_EQ(failed.job(), first.id());
  EXPECT_EQ(failed.error().message(), "no liquid");
  EXPECT_EQ(failed.end_time().seconds(), absl::ToUnixSeconds(now_));

  const Job second = MustSubmitRegistration("f", "a", {"b"});
  EXPECT_FALSE(catalog_->GetFamily("f")->has_failed_registration());
  ASSERT_THAT(catalog_->RequestCancel(second.id()), Succeeds());
  EXPECT_EQ(catalog_->GetFamily("f")->failed_registration().error().code(),
            static_cast<int>(Code::kCancelled));
  EXPECT_EQ(MakeFamily("f", "a", {"b"}), 1);
  EXPECT_FALSE(catalog_->GetFamily("f")->has_failed_registration());

  MustSubmitRegistration("f", "a", {"b", "a"});
  FailNext(absl::InvalidArgumentError("no liquid"), /*retry=*/false);  // of a target
  EXPECT_EQ(catalog_->GetFamily("f")->version(), 1);
  EXPECT_THAT(catalog_->GetFamily("f")->failed_registration().error().message(),
              ::testing::HasSubstr("no liquid"));
}

TEST_P(CatalogSuite, AJobTellsWhenWorkOnItBegan) {
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  const Job job = MustSubmitRegistration("f", "a", {"b"});
  EXPECT_FALSE(GetJob(job.id()).has_first_start_time());
  now_ += absl::Seconds(1);
  const absl::Time began = now_;
  ASSERT_THAT(catalog_->ReleaseJob(MustLease().lease_id), Succeeds());
  now_ += absl::Seconds(1);
  const Lease lease = MustLease();
  EXPECT_EQ(GetJob(job.id()).first_start_time().seconds(), absl::ToUnixSeconds(began));
  EXPECT_EQ(GetJob(job.id()).start_time().seconds(), absl::ToUnixSeconds(now_));
}

TEST_P(CatalogSuite, AJobOfChildrenBeganWithThem) {
  const Job job = MustSubmitThreeTargets();
  now_ += absl::Seconds(1);
  const absl::Time began = now_;
  for (int k = 0; k < 3; ++k) {
    FinishNextChild();
    EXPECT_EQ(GetJob(job.id()).first_start_time().seconds(), absl::ToUnixSeconds(began));
    now_ += absl::Seconds(1);
  }
  MustLease();
  EXPECT_EQ(GetJob(job.id()).first_start_time().seconds(), absl::ToUnixSeconds(began));
}

}  // namespace liquidblend::store

// The part of the catalogs' suite about owners: what they have, and what they may have.
// Included by catalog_suite.h.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

inline pb::JobRecord ImportAs(const std::string& owner, const std::string& id, int64_t size_bytes,
                              const std::string& request_id = "") {
  pb::JobRecord job = ImportOf(id, request_id);
  job.set_owner(owner);
  job.mutable_import_animation()->mutable_files(0)->set_size_bytes(size_bytes);
  return job;
}

// What the catalog tells a check about the owner.
inline OwnerUse UseOf(Catalog& catalog, const std::string& owner) {
  pb::JobRecord job;
  job.set_owner(owner);
  std::optional<OwnerUse> told;
  EXPECT_THAT(catalog.CheckOwner(job,
                                 [&](const OwnerUse& use) {
                                   told = use;
                                   return absl::OkStatus();
                                 }),
              Succeeds());
  // The list agrees with it.
  const auto owners = catalog.ListOwners();
  EXPECT_THAT(owners, Succeeds());
  OwnerUse listed;
  for (const OwnerUse& use : *owners) {
    if (use.owner == owner) listed = use;
  }
  EXPECT_EQ(listed.stored_bytes, told->stored_bytes);
  EXPECT_EQ(listed.num_queued_jobs, told->num_queued_jobs);
  return listed;
}

// May have so many bytes with those of the job.
inline OwnerCheck AtMost(int64_t limit, int64_t new_bytes) {
  return [=](const OwnerUse& use) {
    return use.stored_bytes + new_bytes <= limit
               ? absl::OkStatus()
               : absl::ResourceExhaustedError(absl::StrCat("has ", use.stored_bytes));
  };
}

TEST_P(CatalogSuite, CountsWhatAnOwnerHas) {
  const auto publish = [&](const std::string& id, const std::string& blob, int64_t size_bytes) {
    Animation animation = AnimationCalled(id);
    animation.set_blob(blob);
    animation.set_size_bytes(size_bytes);
    EXPECT_THAT(catalog_->PublishAnimation(MustLease().lease_id, animation), Succeeds());
  };
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 0);
  ASSERT_THAT(catalog_->SubmitImport(AnimationCalled("a"), ImportAs("ann", "a", 100)), Succeeds());
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 100);  // the upload
  EXPECT_EQ(UseOf(*catalog_, "ann").num_queued_jobs, 1);
  publish("a", "blob 1", 70);
  EXPECT_EQ(GetAnimation("a").owner(), "ann");
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 70);  // its file instead
  EXPECT_EQ(UseOf(*catalog_, "ann").num_queued_jobs, 0);
  for (const std::string id : {"b", "c"}) {
    ASSERT_THAT(catalog_->SubmitImport(AnimationCalled(id), ImportAs("ann", id, 9)), Succeeds());
  }
  publish("b", "blob 2", 5);
  publish("c", "blob 1", 70);  // the same file
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 75);
  EXPECT_EQ(UseOf(*catalog_, "ann").num_animations, 3);
  EXPECT_EQ(UseOf(*catalog_, "bob").stored_bytes, 0);

  Job registration = RegistrationOf("f", "a", {"b", "c"});
  registration.set_owner("bob");
  ASSERT_THAT(catalog_->SubmitRegistration(registration), Succeeds());
  EXPECT_EQ(UseOf(*catalog_, "bob").num_queued_jobs, 1);  // its children do not count
  EXPECT_EQ(UseOf(*catalog_, "bob").num_families, 0);
  FinishNextChild();
  FinishNextChild();
  pb::FamilyRecord family;
  family.set_id("f");
  family.set_blob("blob 3");
  family.set_size_bytes(1000);
  ASSERT_THAT(catalog_->PublishFamily(MustLease().lease_id, family), Succeeds());
  EXPECT_EQ(UseOf(*catalog_, "bob").stored_bytes, 1000);
  EXPECT_EQ(UseOf(*catalog_, "bob").num_families, 1);
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 75);

  // Deleting gives room back.
  ASSERT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  EXPECT_EQ(UseOf(*catalog_, "bob").stored_bytes, 0);
  ASSERT_THAT(catalog_->DeleteAnimation("a"), Succeeds());
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 75);  // "c" has the same file
  ASSERT_THAT(catalog_->DeleteAnimation("c"), Succeeds());
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 5);
}

TEST_P(CatalogSuite, WhatFailedToBeImportedTakesNoRoom) {
  ASSERT_THAT(catalog_->SubmitImport(AnimationCalled("a"), ImportAs("ann", "a", 100)), Succeeds());
  FailNext(absl::DataLossError("torn"), /*retry=*/false);
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 0);
  EXPECT_EQ(UseOf(*catalog_, "ann").num_queued_jobs, 0);
  // Whoever imports it again owns it.
  ASSERT_THAT(catalog_->SubmitImport(AnimationCalled("a"), ImportAs("bob", "a", 30)), Succeeds());
  EXPECT_EQ(UseOf(*catalog_, "bob").stored_bytes, 30);
}

TEST_P(CatalogSuite, RefusesWhatTheOwnerMayNotHave) {
  for (const std::string id : {"x", "y"}) MakeAnimation(id);
  const auto submit = [&](const std::string& id, int64_t size_bytes, const std::string& request) {
    return catalog_->SubmitImport(AnimationCalled(id), ImportAs("ann", id, size_bytes, request),
                                  AtMost(100, size_bytes));
  };
  const auto first = submit("a", 60, "one");
  ASSERT_THAT(first, Succeeds());
  EXPECT_THAT(submit("b", 41, ""), Fails(Code::kResourceExhausted, "has 60"));
  EXPECT_THAT(catalog_->GetAnimation("b"), Fails(Code::kNotFound, "'b'"));
  EXPECT_THAT(submit("b", 40, ""), Succeeds());
  // What was accepted stays accepted.
  const auto again = submit("a", 60, "one");
  ASSERT_THAT(again, Succeeds());
  EXPECT_EQ(again->id(), first->id());
  const OwnerCheck none = [](const OwnerUse&) { return absl::ResourceExhaustedError("none"); };
  EXPECT_THAT(catalog_->CheckOwner(ImportAs("ann", "a", 60, "one"), none), Succeeds());
  EXPECT_THAT(catalog_->CheckOwner(ImportAs("ann", "a", 60, "two"), none),
              Fails(Code::kResourceExhausted, "none"));
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("f", "x", {"y"}), none),
              Fails(Code::kResourceExhausted, "none"));
  EXPECT_THAT(catalog_->GetFamily("f"), Fails(Code::kNotFound, "'f'"));
}

TEST_P(CatalogSuite, ManyAtOnceDoNotPassALimitTogether) {
  std::vector<std::thread> clients;
  std::atomic<int> num_accepted = 0;
  for (int k = 0; k < 4; ++k) {
    clients.emplace_back([&, k] {
      const std::unique_ptr<Catalog> catalog = backend_->Open(Options());
      for (int i = 0; i < 5; ++i) {
        const std::string id = absl::StrCat("a", k, "-", i);
        const auto job =
            catalog->SubmitImport(AnimationCalled(id), ImportAs("ann", id, 10), AtMost(70, 10));
        if (job.ok()) ++num_accepted;
      }
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(num_accepted, 7);
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 70);
}

TEST_P(CatalogSuite, AnImportedCatalogKnowsItsOwners) {
  Job job = ImportAs("ann", "a", 10);
  job.set_id("import-a");
  job.set_state(Job::SUCCEEDED);
  CatalogContents contents;
  contents.jobs = {job};
  Animation animation = AnimationCalled("a");  // as programs wrote it that knew of no owners
  animation.set_state(Animation::READY);
  animation.set_blob("blob 1");
  animation.set_size_bytes(7);
  contents.animations = {animation};
  ASSERT_THAT(catalog_->Import(contents), Succeeds());
  EXPECT_EQ(GetAnimation("a").owner(), "ann");
  EXPECT_EQ(UseOf(*catalog_, "ann").stored_bytes, 7);
}

}  // namespace liquidblend::store

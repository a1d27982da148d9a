// What the tests of a Catalog begin with: an empty one, jobs, and shorthands for its calls.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/store/catalog/catalog.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {

// An empty catalog.
class CatalogBackend {
 public:
  virtual ~CatalogBackend() = default;
  // One more handle on the same catalog.
  virtual std::unique_ptr<Catalog> Open(const CatalogOptions& options) = 0;
};

inline pb::JobRecord ImportOf(const std::string& animation, const std::string& request_id = "") {
  pb::JobRecord job;
  job.set_request_id(request_id);
  job.mutable_import_animation()->set_animation(animation);
  pb::SourceFile* const file = job.mutable_import_animation()->add_files();
  file->set_name("frame_0001.ply");
  file->set_blob("upload-of-" + animation);
  return job;
}

inline pb::AnimationRecord AnimationCalled(const std::string& id) {
  pb::AnimationRecord animation;
  animation.set_id(id);
  return animation;
}

inline pb::JobRecord RegistrationOf(const std::string& family, const std::string& source,
                                    const std::vector<std::string>& targets,
                                    const std::string& request_id = "") {
  pb::JobRecord job;
  job.set_request_id(request_id);
  job.mutable_register_family()->set_family(family);
  job.mutable_register_family()->set_source(source);
  for (const std::string& target : targets) job.mutable_register_family()->add_targets(target);
  return job;
}

class CatalogSuite : public ::testing::TestWithParam<std::unique_ptr<CatalogBackend> (*)()> {
 protected:
  using Job = pb::JobRecord;
  using Animation = pb::AnimationRecord;
  using Code = absl::StatusCode;

  static constexpr absl::Duration kLease = absl::Seconds(30);

  CatalogOptions Options() {
    CatalogOptions options;
    options.busy_timeout = absl::Minutes(1);
    options.retry.max_attempts = 3;
    options.retry.random = [this] { return random_; };
    options.now = [this] { return now_; };
    return options;
  }

  Job MustSubmitImport(const std::string& id, const std::string& request_id = "") {
    auto job = catalog_->SubmitImport(AnimationCalled(id), ImportOf(id, request_id));
    EXPECT_THAT(job, Succeeds());
    return job.ok() ? *job : Job();
  }

  Job MustSubmitRegistration(const std::string& family, const std::string& source,
                             const std::vector<std::string>& targets) {
    auto job = catalog_->SubmitRegistration(RegistrationOf(family, source, targets));
    EXPECT_THAT(job, Succeeds());
    return job.ok() ? *job : Job();
  }

  // The next job; must be there.
  Lease MustLease(const std::string& worker = "worker") {
    auto lease = catalog_->LeaseJob(worker, kLease);
    EXPECT_THAT(lease, Succeeds());
    EXPECT_TRUE(lease.ok() && lease->has_value());
    return lease.ok() && lease->has_value() ? **lease : Lease();
  }

  bool NothingToDo() {
    auto lease = catalog_->LeaseJob("worker", kLease);
    EXPECT_THAT(lease, Succeeds());
    return lease.ok() && !lease->has_value();
  }

  void MakeAnimation(const std::string& id) {
    MustSubmitImport(id);
    Animation animation = AnimationCalled(id);
    animation.set_blob("blob-of-" + id);
    animation.set_num_vertices(42);
    EXPECT_THAT(catalog_->PublishAnimation(MustLease().lease_id, animation), Succeeds());
  }

  int64_t MakeFamily(const std::string& id, const std::string& source,
                     const std::vector<std::string>& targets) {
    MustSubmitRegistration(id, source, targets);
    pb::FamilyRecord family;
    family.set_id(id);
    family.set_blob("blob-of-" + id);
    const auto version = catalog_->PublishFamily(MustLease().lease_id, family);
    EXPECT_THAT(version, Succeeds());
    return version.ok() ? *version : 0;
  }

  // A queued registration of family f: a -> b, c, d.
  Job MustSubmitThreeTargets() {
    for (const std::string id : {"a", "b", "c", "d"}) MakeAnimation(id);
    return MustSubmitRegistration("f", "a", {"b", "c", "d"});
  }

  std::vector<Job> ChildrenOf(const Job& job) {
    auto children = catalog_->ListChildren(job.id());
    EXPECT_THAT(children, Succeeds());
    return children.ok() ? *std::move(children) : std::vector<Job>();
  }

  // Takes the next child, which must be there, and finishes it.
  void FinishNextChild() {
    const Lease lease = MustLease();
    EXPECT_TRUE(lease.job.has_register_target());
    EXPECT_THAT(catalog_->FinishChild(lease.lease_id, "blob-of-" + lease.job.id()), Succeeds());
  }

  Job MustSubmitAs(const std::string& owner, const std::string& id, int priority = 0) {
    Job job = ImportOf(id);
    job.set_owner(owner);
    job.set_priority(priority);
    const auto submitted = catalog_->SubmitImport(AnimationCalled(id), job);
    EXPECT_THAT(submitted, Succeeds());
    return submitted.ok() ? *submitted : Job();
  }

  Job MustSubmitOfMemory(const std::string& id, int64_t memory_bytes) {
    Job job = ImportOf(id);
    job.set_memory_bytes(memory_bytes);
    const auto submitted = catalog_->SubmitImport(AnimationCalled(id), job);
    EXPECT_THAT(submitted, Succeeds());
    return submitted.ok() ? *submitted : Job();
  }

  // `num` jobs of the owner: the animations OWNER1, OWNER2, ...
  void MustSubmitMany(const std::string& owner, int num) {
    for (int k = 1; k <= num; ++k) MustSubmitAs(owner, absl::StrCat(owner, k));
  }

  // The animations of the next imports, in the order in which they are given out.
  std::vector<std::string> Next(int num) {
    std::vector<std::string> ids;
    for (int k = 0; k < num; ++k) ids.push_back(MustLease().job.import_animation().animation());
    return ids;
  }

  // Takes the next job, which must be there, and fails it.
  Job FailNext(const absl::Status& error, bool retry = true) {
    const Lease lease = MustLease();
    EXPECT_THAT(catalog_->FailJob(lease.lease_id, error, retry), Succeeds());
    return lease.job;
  }

  Job GetJob(const std::string& id) {
    auto job = catalog_->GetJob(id);
    EXPECT_THAT(job, Succeeds());
    return job.ok() ? *job : Job();
  }

  Animation GetAnimation(const std::string& id) {
    auto animation = catalog_->GetAnimation(id);
    EXPECT_THAT(animation, Succeeds());
    return animation.ok() ? *animation : Animation();
  }

  double random_ = 0.5;  // no jitter
  absl::Time now_ = absl::FromUnixSeconds(1700000000) + absl::Microseconds(250);
  std::unique_ptr<CatalogBackend> backend_ = GetParam()();
  std::unique_ptr<Catalog> catalog_ = backend_->Open(Options());
};

}  // namespace liquidblend::store

// What every backend of Catalog must do. A backend's test includes this and instantiates
// CatalogSuite with a function that makes one CatalogBackend.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "core/store/catalog.h"
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
    options.max_attempts = 3;
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

  std::vector<Job> PartsOf(const Job& job) {
    auto parts = catalog_->ListParts(job.id());
    EXPECT_THAT(parts, Succeeds());
    return parts.ok() ? *std::move(parts) : std::vector<Job>();
  }

  // Takes the next part, which must be there, and finishes it.
  void FinishNextPart() {
    const Lease lease = MustLease();
    EXPECT_TRUE(lease.job.has_register_target());
    EXPECT_THAT(catalog_->FinishPart(lease.lease_id, "blob-of-" + lease.job.id()), Succeeds());
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

  absl::Time now_ = absl::FromUnixSeconds(1700000000) + absl::Microseconds(250);
  std::unique_ptr<CatalogBackend> backend_ = GetParam()();
  std::unique_ptr<Catalog> catalog_ = backend_->Open(Options());
};

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

// ---- the queue

TEST_P(CatalogSuite, GivesOutTheOldestJobOnce) {
  const Job first = MustSubmitImport("b");
  const Job second = MustSubmitImport("a");
  const Lease lease = MustLease("worker 7");
  EXPECT_EQ(lease.job.id(), first.id());
  EXPECT_EQ(lease.job.state(), Job::RUNNING);
  EXPECT_EQ(lease.job.worker(), "worker 7");
  EXPECT_EQ(lease.job.attempts(), 1);
  EXPECT_EQ(GetJob(first.id()).SerializeAsString(), lease.job.SerializeAsString());
  EXPECT_EQ(MustLease().job.id(), second.id());
  EXPECT_TRUE(NothingToDo());
}

TEST_P(CatalogSuite, RecordsProgress) {
  const Job job = MustSubmitImport("a");
  const Lease lease = MustLease();
  pb::JobProgress progress;
  progress.set_stage("reading");
  progress.set_fraction(0.25);
  now_ += absl::Seconds(5);
  const auto control = catalog_->Heartbeat(lease.lease_id, kLease, progress);
  ASSERT_THAT(control, Succeeds());
  EXPECT_FALSE(control->cancel_requested);
  EXPECT_EQ(GetJob(job.id()).progress().stage(), "reading");
  EXPECT_EQ(GetJob(job.id()).progress().fraction(), 0.25);
  EXPECT_EQ(GetJob(job.id()).update_time().seconds(), 1700000005);
}

TEST_P(CatalogSuite, FencesOffAWorkerWhoseLeaseWasGivenToAnother) {
  MustSubmitImport("a");
  const Lease old = MustLease("paused");
  now_ += kLease;
  const Lease current = MustLease("other");
  EXPECT_EQ(current.job.id(), old.job.id());
  EXPECT_EQ(current.job.attempts(), 2);
  EXPECT_NE(current.lease_id, old.lease_id);
  EXPECT_THAT(catalog_->Heartbeat(old.lease_id, kLease, {}), Fails(Code::kAborted, old.lease_id));
  EXPECT_THAT(catalog_->PublishAnimation(old.lease_id, AnimationCalled("a")),
              Fails(Code::kAborted, old.lease_id));
  EXPECT_THAT(catalog_->PublishFamily(old.lease_id, {}), Fails(Code::kAborted, old.lease_id));
  EXPECT_THAT(catalog_->FailJob(old.lease_id, absl::InternalError("no"), true),
              Fails(Code::kAborted, old.lease_id));
  EXPECT_THAT(catalog_->ReleaseJob(old.lease_id), Fails(Code::kAborted, old.lease_id));
  EXPECT_EQ(GetAnimation("a").state(), Animation::IMPORTING);
  EXPECT_THAT(catalog_->PublishAnimation(current.lease_id, AnimationCalled("a")), Succeeds());
  EXPECT_THAT(catalog_->Heartbeat(current.lease_id, kLease, {}),
              Fails(Code::kAborted, current.lease_id));
  EXPECT_THAT(catalog_->Heartbeat("", kLease, {}), Fails(Code::kAborted, "''"));
}

TEST_P(CatalogSuite, KeepsALeaseThatIsRenewed) {
  MustSubmitImport("a");
  const Lease lease = MustLease();
  for (int k = 0; k < 5; ++k) {
    now_ += kLease - absl::Microseconds(1);
    EXPECT_TRUE(NothingToDo());
    EXPECT_THAT(catalog_->Heartbeat(lease.lease_id, kLease, {}), Succeeds());
  }
  now_ += 2 * kLease;  // late, but nobody else has it
  EXPECT_THAT(catalog_->Heartbeat(lease.lease_id, kLease, {}), Succeeds());
  EXPECT_TRUE(NothingToDo());
  EXPECT_EQ(GetJob(lease.job.id()).attempts(), 1);
}

TEST_P(CatalogSuite, GivesUpAJobThatLosesItsWorkers) {
  const Job poison = MustSubmitImport("poison");
  const Job next = MustSubmitImport("next");
  for (int attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(MustLease("worker 9").job.attempts(), attempt);
    now_ += kLease;
  }
  EXPECT_EQ(MustLease().job.id(), next.id());
  const Job job = GetJob(poison.id());
  EXPECT_EQ(job.state(), Job::FAILED);
  EXPECT_EQ(job.error().code(), static_cast<int>(Code::kInternal));
  EXPECT_THAT(job.error().message(), ::testing::HasSubstr("lost 3 times, last on worker 9"));
  EXPECT_EQ(GetAnimation("poison").state(), Animation::FAILED);
  EXPECT_EQ(GetAnimation("poison").error().message(), job.error().message());
}

TEST_P(CatalogSuite, RetriesWhileAttemptsAreLeft) {
  const Job job = MustSubmitImport("a");
  for (int attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(GetJob(job.id()).state(), Job::QUEUED);
    EXPECT_EQ(GetAnimation("a").state(), Animation::IMPORTING);
    const Lease lease = MustLease();
    EXPECT_EQ(lease.job.attempts(), attempt);
    EXPECT_THAT(catalog_->FailJob(lease.lease_id, absl::UnavailableError("try again"), true),
                Succeeds());
  }
  EXPECT_TRUE(NothingToDo());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_EQ(GetJob(job.id()).error().message(), "try again");
}

TEST_P(CatalogSuite, KeepsTheErrorOfAFailedJob) {
  const Job job = MustSubmitImport("a");
  EXPECT_THAT(catalog_->FailJob("", absl::OkStatus(), false), Fails(Code::kInvalidArgument, ""));
  EXPECT_THAT(catalog_->FailJob(MustLease().lease_id,
                                absl::InvalidArgumentError("fl\xfc"
                                                           "ssig.ply: frame 3"),
                                false),
              Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_EQ(GetJob(job.id()).error().code(), static_cast<int>(Code::kInvalidArgument));
  EXPECT_EQ(GetJob(job.id()).error().message(), "fl?ssig.ply: frame 3");
  EXPECT_EQ(GetAnimation("a").state(), Animation::FAILED);
  EXPECT_EQ(GetAnimation("a").error().message(), "fl?ssig.ply: frame 3");
}

TEST_P(CatalogSuite, TakesAJobBackUntouched) {
  const Job job = MustSubmitImport("a");
  for (int k = 0; k < 5; ++k) EXPECT_THAT(catalog_->ReleaseJob(MustLease().lease_id), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::QUEUED);
  EXPECT_EQ(GetJob(job.id()).attempts(), 0);
  EXPECT_EQ(GetJob(job.id()).worker(), "");
}

TEST_P(CatalogSuite, CancelsAQueuedJobAtOnce) {
  const Job job = MustSubmitImport("a");
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
  EXPECT_EQ(GetJob(job.id()).error().code(), static_cast<int>(Code::kCancelled));
  EXPECT_EQ(GetAnimation("a").state(), Animation::FAILED);
  EXPECT_TRUE(NothingToDo());
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
}

TEST_P(CatalogSuite, TellsTheWorkerOfACancelledJob) {
  const Job job = MustSubmitImport("a");
  const Lease lease = MustLease();
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::RUNNING);
  EXPECT_TRUE(GetJob(job.id()).cancel_requested());
  const auto control = catalog_->Heartbeat(lease.lease_id, kLease, {});
  ASSERT_THAT(control, Succeeds());
  EXPECT_TRUE(control->cancel_requested);
  EXPECT_THAT(catalog_->FailJob(lease.lease_id, absl::CancelledError("stopped"), false),
              Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
}

TEST_P(CatalogSuite, ACancelledJobIsNotTriedAgain) {
  const auto end = [&](const std::string& id, const auto& act) {
    const Job job = MustSubmitImport(id);
    const Lease lease = MustLease();
    EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
    act(lease);
    EXPECT_TRUE(NothingToDo());
    EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED) << id;
  };
  end("failed", [&](const Lease& lease) {
    EXPECT_THAT(catalog_->FailJob(lease.lease_id, absl::UnavailableError("net"), true), Succeeds());
  });
  end("released",
      [&](const Lease& lease) { EXPECT_THAT(catalog_->ReleaseJob(lease.lease_id), Succeeds()); });
  end("lost", [&](const Lease&) { now_ += kLease; });
  const Job job = MustSubmitImport("lost before");
  MustLease();
  now_ += kLease;
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
}

TEST_P(CatalogSuite, AResultThatIsThereBeatsACancellation) {
  const Job job = MustSubmitImport("a");
  const Lease lease = MustLease();
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_THAT(catalog_->PublishAnimation(lease.lease_id, AnimationCalled("a")), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::SUCCEEDED);
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::SUCCEEDED);
}

// ---- registrations of several targets

TEST_P(CatalogSuite, GivesOutTheTargetsOfARegistrationSideBySide) {
  const Job job = MustSubmitThreeTargets();
  EXPECT_EQ(job.state(), Job::WAITING);
  const Lease first = MustLease("one"), second = MustLease("two");
  EXPECT_EQ(first.job.parent(), job.id());
  EXPECT_EQ(first.job.register_target().family(), "f");
  EXPECT_EQ(first.job.register_target().target_index(), 0);
  EXPECT_EQ(second.job.parent(), job.id());
  EXPECT_EQ(second.job.register_target().target_index(), 1);
  pb::JobProgress progress;
  progress.set_iteration(7);
  EXPECT_THAT(catalog_->Heartbeat(second.lease_id, kLease, progress), Succeeds());
  const std::vector<Job> parts = PartsOf(job);
  ASSERT_EQ(parts.size(), 3);
  EXPECT_EQ(parts[0].worker(), "one");
  EXPECT_EQ(parts[1].worker(), "two");
  EXPECT_EQ(parts[1].progress().iteration(), 7);
  EXPECT_EQ(parts[2].state(), Job::QUEUED);
  EXPECT_EQ(parts[2].register_target().target_index(), 2);
  EXPECT_EQ(GetJob(job.id()).SerializeAsString(), job.SerializeAsString());
}

TEST_P(CatalogSuite, ShowsARegistrationAsOneJob) {
  const Job job = MustSubmitThreeTargets();
  const std::string part = PartsOf(job)[0].id();
  const auto jobs = catalog_->ListJobs(0, "");
  ASSERT_THAT(jobs, Succeeds());
  EXPECT_EQ(jobs->records.size(), 5);  // with four imports
  EXPECT_EQ(jobs->records[0].id(), job.id());
  EXPECT_THAT(catalog_->GetJob(part), Fails(Code::kNotFound, part));
  EXPECT_THAT(catalog_->DeleteJob(part), Fails(Code::kNotFound, part));
  EXPECT_THAT(catalog_->RequestCancel(part), Fails(Code::kNotFound, part));
  EXPECT_THAT(catalog_->ListParts("x"), Succeeds());
  EXPECT_TRUE(PartsOf(MustSubmitRegistration("g", "a", {"b"})).empty());
}

TEST_P(CatalogSuite, QueuesARegistrationWithTheEndOfItsLastPart) {
  const Job job = MustSubmitThreeTargets();
  const Lease first = MustLease(), second = MustLease(), third = MustLease();
  EXPECT_TRUE(NothingToDo());
  EXPECT_THAT(catalog_->FinishPart(third.lease_id, "blob 3"), Succeeds());
  EXPECT_THAT(catalog_->FinishPart(first.lease_id, "blob 1"), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::WAITING);
  EXPECT_TRUE(NothingToDo());
  now_ += absl::Seconds(7);
  EXPECT_THAT(catalog_->FinishPart(second.lease_id, "blob 2"), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::QUEUED);
  EXPECT_EQ(GetJob(job.id()).update_time().seconds(), 1700000007);
  const Lease last = MustLease("assembler");
  EXPECT_EQ(last.job.id(), job.id());
  EXPECT_EQ(last.job.attempts(), 1);
  const std::vector<Job> parts = PartsOf(job);
  ASSERT_EQ(parts.size(), 3);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(parts[k].state(), Job::SUCCEEDED);
    EXPECT_EQ(parts[k].result_blob(), absl::StrCat("blob ", k + 1));
  }
  pb::FamilyRecord family;
  family.set_id("f");
  EXPECT_THAT(catalog_->PublishFamily(last.lease_id, family), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::SUCCEEDED);
  EXPECT_TRUE(PartsOf(job).empty());
  EXPECT_THAT(catalog_->DeleteAnimation("d"), Fails(Code::kFailedPrecondition, "family 'f'"));
  EXPECT_TRUE(NothingToDo());
}

TEST_P(CatalogSuite, TriesToPutTheResultsTogetherAgain) {
  const Job job = MustSubmitThreeTargets();
  for (int k = 0; k < 3; ++k) FinishNextPart();
  EXPECT_EQ(MustLease().job.id(), job.id());
  now_ += kLease;  // lost
  const Lease second = MustLease();
  EXPECT_EQ(second.job.id(), job.id());
  EXPECT_EQ(second.job.attempts(), 2);
  EXPECT_THAT(catalog_->FailJob(second.lease_id, absl::UnavailableError("net"), true), Succeeds());
  EXPECT_EQ(PartsOf(job).size(), 3);
  const Lease third = MustLease();
  EXPECT_EQ(third.job.id(), job.id());
  EXPECT_THAT(catalog_->FailJob(third.lease_id, absl::UnavailableError("net"), true), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_TRUE(PartsOf(job).empty());
}

TEST_P(CatalogSuite, RefusesResultsOfOthersAsParts) {
  const Job job = MustSubmitThreeTargets();
  const Lease part = MustLease();
  pb::FamilyRecord family;
  family.set_id("f");
  EXPECT_THAT(catalog_->PublishFamily(part.lease_id, family),
              Fails(Code::kInvalidArgument, part.job.id()));
  EXPECT_EQ(catalog_->GetFamily("f")->version(), 0);
  EXPECT_THAT(catalog_->FinishPart("x", "blob"), Fails(Code::kAborted, "'x'"));
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  const Job import = MustSubmitImport("e");
  EXPECT_THAT(catalog_->FinishPart(MustLease().lease_id, "blob"),
              Fails(Code::kInvalidArgument, import.id()));
}

TEST_P(CatalogSuite, APartThatFailsForGoodFailsItsRegistration) {
  const Job job = MustSubmitThreeTargets();
  FinishNextPart();
  const Lease second = MustLease(), third = MustLease();
  EXPECT_THAT(catalog_->FailJob(third.lease_id, absl::DataLossError("frame 3 is bad"), false),
              Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_EQ(GetJob(job.id()).error().code(), static_cast<int>(Code::kDataLoss));
  EXPECT_EQ(GetJob(job.id()).error().message(), "target 'd': frame 3 is bad");
  EXPECT_TRUE(PartsOf(job).empty());
  EXPECT_TRUE(NothingToDo());
  EXPECT_THAT(catalog_->Heartbeat(second.lease_id, kLease, {}),
              Fails(Code::kAborted, second.lease_id));
  EXPECT_THAT(catalog_->FinishPart(second.lease_id, "late"),
              Fails(Code::kAborted, second.lease_id));
  EXPECT_THAT(catalog_->DeleteJob(job.id()), Succeeds());
}

TEST_P(CatalogSuite, APartIsTriedAgainLikeAnyJob) {
  const Job job = MustSubmitThreeTargets();
  const Lease first = MustLease();
  EXPECT_THAT(catalog_->FailJob(first.lease_id, absl::UnavailableError("net"), true), Succeeds());
  const Lease again = MustLease();
  EXPECT_EQ(again.job.id(), first.job.id());
  EXPECT_EQ(again.job.attempts(), 2);
  EXPECT_THAT(catalog_->ReleaseJob(again.lease_id), Succeeds());
  EXPECT_EQ(PartsOf(job)[0].attempts(), 1);
  EXPECT_EQ(GetJob(job.id()).state(), Job::WAITING);
}

TEST_P(CatalogSuite, APartOfALostWorkerIsGivenToAnother) {
  const Job job = MustSubmitThreeTargets();
  const Lease old = MustLease("paused");
  now_ += kLease;
  const Lease current = MustLease("other");
  EXPECT_EQ(current.job.id(), old.job.id());
  EXPECT_EQ(current.job.attempts(), 2);
  EXPECT_THAT(catalog_->FinishPart(old.lease_id, "blob"), Fails(Code::kAborted, old.lease_id));
  EXPECT_THAT(catalog_->FinishPart(current.lease_id, "blob"), Succeeds());
  EXPECT_THAT(catalog_->FinishPart(current.lease_id, "blob"),
              Fails(Code::kAborted, current.lease_id));
  EXPECT_EQ(PartsOf(job)[0].state(), Job::SUCCEEDED);
}

TEST_P(CatalogSuite, APartThatLosesItsWorkersFailsItsRegistration) {
  const Job job = MustSubmitThreeTargets();
  for (int k = 0; k < 2; ++k) FinishNextPart();
  for (int attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(MustLease("worker 9").job.attempts(), attempt);
    now_ += kLease;
  }
  EXPECT_TRUE(NothingToDo());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_THAT(GetJob(job.id()).error().message(), ::testing::StartsWith("target 'd': "));
  EXPECT_THAT(GetJob(job.id()).error().message(),
              ::testing::HasSubstr("lost 3 times, last on worker 9"));
}

TEST_P(CatalogSuite, CancelsARegistrationWithAllItsParts) {
  const Job job = MustSubmitThreeTargets();
  FinishNextPart();
  const Lease running = MustLease();
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
  EXPECT_TRUE(NothingToDo());
  EXPECT_THAT(catalog_->Heartbeat(running.lease_id, kLease, {}),
              Fails(Code::kAborted, running.lease_id));
  EXPECT_THAT(catalog_->FinishPart(running.lease_id, "blob"),
              Fails(Code::kAborted, running.lease_id));
  EXPECT_TRUE(PartsOf(job).empty());
  MustSubmitRegistration("f", "a", {"b", "c"});
}

TEST_P(CatalogSuite, CancelsARegistrationWhoseResultsArePutTogether) {
  const Job job = MustSubmitThreeTargets();
  for (int k = 0; k < 3; ++k) FinishNextPart();
  const Lease lease = MustLease();
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_TRUE(catalog_->Heartbeat(lease.lease_id, kLease, {})->cancel_requested);
  EXPECT_THAT(catalog_->FailJob(lease.lease_id, absl::CancelledError("stopped"), false),
              Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
  EXPECT_TRUE(PartsOf(job).empty());
}

TEST_P(CatalogSuite, KeepsWhatAWaitingRegistrationNeeds) {
  const Job job = MustSubmitThreeTargets();
  FinishNextPart();
  EXPECT_THAT(catalog_->DeleteFamily("f"), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_THAT(catalog_->DeleteJob(job.id()), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_THAT(catalog_->DeleteAnimation("d"), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("f", "a", {"b"})),
              Fails(Code::kFailedPrecondition, job.id()));
  const Lease part = MustLease();
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  EXPECT_THAT(catalog_->DeleteAnimation("d"), Succeeds());
  EXPECT_THAT(catalog_->FinishPart(part.lease_id, "blob"), Fails(Code::kAborted, part.lease_id));
  EXPECT_THAT(catalog_->GetFamily("f"), Fails(Code::kNotFound, "'f'"));
}

TEST_P(CatalogSuite, NeedsThePartsBlobsUntilTheRegistrationEnds) {
  const Job job = MustSubmitThreeTargets();
  const std::vector<Job> parts = PartsOf(job);
  FinishNextPart();
  EXPECT_THAT(*catalog_->ListReferencedBlobs(),
              ::testing::ElementsAre("blob-of-a", "blob-of-b", "blob-of-c", "blob-of-d",
                                     "blob-of-" + parts[0].id()));
  FinishNextPart();
  FinishNextPart();
  EXPECT_EQ(catalog_->ListReferencedBlobs()->size(), 7);
  const Lease lease = MustLease();
  EXPECT_EQ(catalog_->ListReferencedBlobs()->size(), 7);
  pb::FamilyRecord family;
  family.set_id("f");
  family.set_blob("family");
  EXPECT_THAT(catalog_->PublishFamily(lease.lease_id, family), Succeeds());
  EXPECT_THAT(*catalog_->ListReferencedBlobs(),
              ::testing::ElementsAre("blob-of-a", "blob-of-b", "blob-of-c", "blob-of-d", "family"));
}

TEST_P(CatalogSuite, ARepeatedRequestAddsNoParts) {
  for (const std::string id : {"a", "b", "c"}) MakeAnimation(id);
  const auto one = catalog_->SubmitRegistration(RegistrationOf("f", "a", {"b", "c"}, "request"));
  const auto two = catalog_->SubmitRegistration(RegistrationOf("f", "a", {"b", "c"}, "request"));
  ASSERT_THAT(one, Succeeds());
  ASSERT_THAT(two, Succeeds());
  EXPECT_EQ(one->id(), two->id());
  EXPECT_EQ(PartsOf(*one).size(), 2);
  MustLease();
  MustLease();
  EXPECT_TRUE(NothingToDo());
}

// ---- several at once

TEST_P(CatalogSuite, IsSharedBySeveralHandles) {
  const auto other = backend_->Open(Options());
  const Job job = MustSubmitImport("a");
  EXPECT_EQ(other->GetJob(job.id())->SerializeAsString(), job.SerializeAsString());
  const auto lease = other->LeaseJob("other", kLease);
  ASSERT_THAT(lease, Succeeds());
  EXPECT_EQ((*lease)->job.id(), job.id());
  EXPECT_TRUE(NothingToDo());
  EXPECT_THAT(catalog_->PublishAnimation((*lease)->lease_id, AnimationCalled("a")), Succeeds());
}

TEST_P(CatalogSuite, ThreadsNeverHoldTheSameJob) {
  constexpr int kNumJobs = 24;
  for (int k = 0; k < kNumJobs; ++k) MustSubmitImport(absl::StrCat("a", k));
  std::vector<std::vector<std::string>> taken(4);
  std::vector<std::thread> threads;
  for (std::vector<std::string>& mine : taken) {
    threads.emplace_back([&] {
      while (true) {
        const auto lease = catalog_->LeaseJob("thread", kLease);
        if (!lease.ok() || !lease->has_value()) return;
        mine.push_back((*lease)->job.id());
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::multiset<std::string> all;
  for (const std::vector<std::string>& mine : taken) all.insert(mine.begin(), mine.end());
  EXPECT_EQ(all.size(), kNumJobs);
  EXPECT_EQ(std::set<std::string>(all.begin(), all.end()).size(), kNumJobs);
}

// Four threads finish eight parts as fast as they can; whoever finishes the last one, one of them
// gets the registration, and none before.
TEST_P(CatalogSuite, ThreadsFinishPartsUntilTheRegistrationIsQueuedOnce) {
  std::vector<std::string> targets;
  for (int k = 0; k < 8; ++k) {
    MakeAnimation(targets.emplace_back(absl::StrCat("a", k)));
  }
  const Job job = MustSubmitRegistration("f", "a0", targets);
  std::atomic<int> num_parts = 0, num_wholes = 0;
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k) {
    threads.emplace_back([&] {
      const auto catalog = backend_->Open(Options());
      const absl::Time deadline = absl::Now() + absl::Minutes(1);
      while (num_wholes == 0 && absl::Now() < deadline) {
        const auto lease = catalog->LeaseJob("thread", kLease);
        ASSERT_THAT(lease, Succeeds());
        if (!lease->has_value()) continue;
        if ((*lease)->job.id() == job.id()) {
          EXPECT_EQ(num_parts, 8);
          ++num_wholes;
        } else {
          ++num_parts;
          EXPECT_THAT(catalog->FinishPart((*lease)->lease_id, "blob"), Succeeds());
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_parts, 8);
  EXPECT_EQ(num_wholes, 1);
}

// Four processes work through 200 jobs; each job is noted by whoever finished it.
TEST_P(CatalogSuite, ProcessesNeverHoldTheSameJob) {
  constexpr int kNumJobs = 200;
  for (int k = 0; k < kNumJobs; ++k) MustSubmitImport(absl::StrCat("a", k));
  const TemporaryFolder notes;
  std::vector<pid_t> children;
  for (int child = 0; child < 4; ++child) {
    children.push_back(StartChild([&] {
      const auto catalog = backend_->Open(Options());
      std::ofstream note(absl::StrCat(notes.path(), "/", child));
      while (true) {
        const auto lease = catalog->LeaseJob(absl::StrCat("process ", child), kLease);
        if (!lease.ok()) return 1;
        if (!lease->has_value()) return 0;
        const std::string id = (*lease)->job.import_animation().animation();
        note << id << "\n";
        if (!catalog->PublishAnimation((*lease)->lease_id, AnimationCalled(id)).ok()) return 2;
      }
    }));
  }
  for (const pid_t child : children) EXPECT_EQ(WaitFor(child), 0);
  std::multiset<std::string> taken;
  for (int child = 0; child < 4; ++child) {
    std::ifstream note(absl::StrCat(notes.path(), "/", child));
    for (std::string id; std::getline(note, id);) taken.insert(id);
  }
  EXPECT_EQ(taken.size(), kNumJobs);
  EXPECT_EQ(std::set<std::string>(taken.begin(), taken.end()).size(), kNumJobs);
  const auto jobs = catalog_->ListJobs(kNumJobs, "");
  ASSERT_THAT(jobs, Succeeds());
  for (const Job& job : jobs->records) {
    EXPECT_EQ(job.state(), Job::SUCCEEDED);
    EXPECT_EQ(job.attempts(), 1);
  }
}

}  // namespace liquidblend::store

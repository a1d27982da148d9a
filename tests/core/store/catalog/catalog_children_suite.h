// CatalogSuite: registrations of several targets. Included by catalog_suite.h.
#pragma once

#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/store/catalog/job_records.h"
#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

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
  const std::vector<Job> children = ChildrenOf(job);
  ASSERT_EQ(children.size(), 3);
  EXPECT_EQ(children[0].worker(), "one");
  EXPECT_EQ(children[1].worker(), "two");
  EXPECT_EQ(children[1].progress().iteration(), 7);
  EXPECT_EQ(children[2].state(), Job::QUEUED);
  EXPECT_EQ(children[2].register_target().target_index(), 2);
  EXPECT_EQ(GetJob(job.id()).SerializeAsString(), job.SerializeAsString());
}

TEST_P(CatalogSuite, ShowsARegistrationAsOneJob) {
  const Job job = MustSubmitThreeTargets();
  const std::string child = ChildrenOf(job)[0].id();
  const auto jobs = catalog_->ListJobs(0, "");
  ASSERT_THAT(jobs, Succeeds());
  EXPECT_EQ(jobs->records.size(), 5);  // with four imports
  EXPECT_EQ(jobs->records[0].id(), job.id());
  EXPECT_THAT(catalog_->GetJob(child), Fails(Code::kNotFound, child));
  EXPECT_THAT(catalog_->DeleteJob(child), Fails(Code::kNotFound, child));
  EXPECT_THAT(catalog_->RequestCancel(child), Fails(Code::kNotFound, child));
  EXPECT_THAT(catalog_->ListChildren("x"), Succeeds());
  EXPECT_TRUE(ChildrenOf(MustSubmitRegistration("g", "a", {"b"})).empty());
}

TEST_P(CatalogSuite, CountsJobsAndChildrenByState) {
  EXPECT_THAT(*catalog_->CountJobs(), ::testing::IsEmpty());
  const Job job = MustSubmitThreeTargets();
  MustLease();
  const JobCounts expected = {
      {Job::SUCCEEDED, 4}, {Job::WAITING, 1}, {Job::RUNNING, 1}, {Job::QUEUED, 2}};
  EXPECT_EQ(*catalog_->CountJobs(), expected);
}

TEST_P(CatalogSuite, QueuesARegistrationWithTheEndOfItsLastChild) {
  const Job job = MustSubmitThreeTargets();
  const Lease first = MustLease(), second = MustLease(), third = MustLease();
  EXPECT_TRUE(NothingToDo());
  EXPECT_THAT(catalog_->FinishChild(third.lease_id, "blob 3"), Succeeds());
  EXPECT_THAT(catalog_->FinishChild(first.lease_id, "blob 1"), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::WAITING);
  EXPECT_TRUE(NothingToDo());
  now_ += absl::Seconds(7);
  EXPECT_THAT(catalog_->FinishChild(second.lease_id, "blob 2"), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::QUEUED);
  EXPECT_EQ(GetJob(job.id()).update_time().seconds(), 1700000007);
  const Lease last = MustLease("assembler");
  EXPECT_EQ(last.job.id(), job.id());
  EXPECT_EQ(last.job.attempts(), 1);
  const std::vector<Job> children = ChildrenOf(job);
  ASSERT_EQ(children.size(), 3);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(children[k].state(), Job::SUCCEEDED);
    EXPECT_EQ(children[k].result_blob(), absl::StrCat("blob ", k + 1));
  }
  pb::FamilyRecord family;
  family.set_id("f");
  EXPECT_THAT(catalog_->PublishFamily(last.lease_id, family), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::SUCCEEDED);
  EXPECT_TRUE(ChildrenOf(job).empty());
  EXPECT_THAT(catalog_->DeleteAnimation("d"), Fails(Code::kFailedPrecondition, "family 'f'"));
  EXPECT_TRUE(NothingToDo());
}

TEST_P(CatalogSuite, RepeatsChildrenWhoseResultsCannotBeUsed) {
  const Job job = MustSubmitThreeTargets();
  for (int k = 0; k < 3; ++k) FinishNextChild();
  const std::vector<Job> done = ChildrenOf(job);
  const Lease parent = MustLease("assembler");
  now_ += absl::Seconds(7);
  const absl::Status why = absl::FailedPreconditionError("of another mesh");
  EXPECT_THAT(catalog_->RepeatChildren(parent.lease_id, {done[0].id(), done[2].id()}, why),
              Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::WAITING);
  EXPECT_EQ(GetJob(job.id()).attempts(), 0);
  ASSERT_EQ(GetJob(job.id()).failed_attempts_size(), 2);
  const pb::FailedAttempt noted = GetJob(job.id()).failed_attempts(1);
  EXPECT_EQ(noted.error().message(), "target 'd': of another mesh");
  EXPECT_EQ(noted.worker(), done[2].worker());
  EXPECT_EQ(noted.end_time().seconds(), 1700000007);
  const std::vector<Job> again = ChildrenOf(job);
  EXPECT_EQ(again[1].SerializeAsString(), done[1].SerializeAsString());
  for (const int k : {0, 2}) {
    EXPECT_EQ(again[k].state(), Job::QUEUED);
    EXPECT_EQ(again[k].result_blob(), "");
    EXPECT_EQ(again[k].attempts(), 0);
    ASSERT_EQ(again[k].failed_attempts_size(), 1);
    EXPECT_EQ(again[k].failed_attempts(0).error().message(), "of another mesh");
  }
  EXPECT_THAT(catalog_->Heartbeat(parent.lease_id, kLease, {}),
              Fails(Code::kAborted, parent.lease_id));
  FinishNextChild();
  EXPECT_EQ(AttemptNumber(MustLease().job), 2);  // the last child's
  now_ += kLease;                                // whose worker is lost
  EXPECT_EQ(GetJob(job.id()).state(), Job::WAITING);
  FinishNextChild();
  const Lease last = MustLease();
  EXPECT_EQ(last.job.id(), job.id());
  EXPECT_EQ(last.job.attempts(), 1);
  pb::FamilyRecord family;
  family.set_id("f");
  EXPECT_THAT(catalog_->PublishFamily(last.lease_id, family), Succeeds());
  EXPECT_EQ(GetJob(job.id()).failed_attempts_size(), 2) << "the history tells of it";
}

TEST_P(CatalogSuite, ARepeatedChildThatFailsIsToldOfOnce) {
  const Job job = MustSubmitThreeTargets();
  for (int k = 0; k < 3; ++k) FinishNextChild();
  const Lease parent = MustLease();
  EXPECT_THAT(catalog_->RepeatChildren(parent.lease_id, {ChildrenOf(job)[1].id()},
                                       absl::FailedPreconditionError("of another mesh")),
              Succeeds());
  now_ += absl::Seconds(1);
  EXPECT_THAT(catalog_->FailJob(MustLease().lease_id, absl::DataLossError("frame 3"), false),
              Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  ASSERT_EQ(GetJob(job.id()).failed_attempts_size(), 2);
  EXPECT_EQ(GetJob(job.id()).failed_attempts(0).error().message(), "target 'c': of another mesh");
  EXPECT_EQ(GetJob(job.id()).failed_attempts(1).error().message(), "target 'c': frame 3");
}

TEST_P(CatalogSuite, RepeatsNothingElse) {
  const Job job = MustSubmitThreeTargets();
  const absl::Status why = absl::FailedPreconditionError("of another mesh");
  const std::string first = ChildrenOf(job)[0].id();
  const Lease child = MustLease();
  EXPECT_THAT(catalog_->RepeatChildren("x", {first}, why), Fails(Code::kAborted, "'x'"));
  EXPECT_THAT(catalog_->RepeatChildren(child.lease_id, {first}, why),
              Fails(Code::kInvalidArgument, first));
  EXPECT_THAT(catalog_->FinishChild(child.lease_id, "blob"), Succeeds());
  for (int k = 1; k < 3; ++k) FinishNextChild();
  const Lease parent = MustLease();
  EXPECT_THAT(catalog_->RepeatChildren(parent.lease_id, {first, "other.0"}, why),
              Fails(Code::kInvalidArgument, "other.0"));
  EXPECT_EQ(ChildrenOf(job)[0].state(), Job::SUCCEEDED) << "all of them or none";
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_THAT(catalog_->RepeatChildren(parent.lease_id, {first}, why), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
  EXPECT_TRUE(ChildrenOf(job).empty());
}

TEST_P(CatalogSuite, TriesToPutTheResultsTogetherAgain) {
  const Job job = MustSubmitThreeTargets();
  for (int k = 0; k < 3; ++k) FinishNextChild();
  EXPECT_EQ(MustLease().job.id(), job.id());
  now_ += kLease;  // lost
  const Lease second = MustLease();
  EXPECT_EQ(second.job.id(), job.id());
  EXPECT_EQ(second.job.attempts(), 2);
  EXPECT_THAT(catalog_->FailJob(second.lease_id, absl::InternalError("odd"), true), Succeeds());
  EXPECT_EQ(ChildrenOf(job).size(), 3);
  now_ += absl::Seconds(2);
  EXPECT_EQ(FailNext(absl::InternalError("odd")).id(), job.id());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_TRUE(ChildrenOf(job).empty());
}

TEST_P(CatalogSuite, RefusesResultsOfOthersAsChildren) {
  const Job job = MustSubmitThreeTargets();
  const Lease child = MustLease();
  pb::FamilyRecord family;
  family.set_id("f");
  EXPECT_THAT(catalog_->PublishFamily(child.lease_id, family),
              Fails(Code::kInvalidArgument, child.job.id()));
  EXPECT_EQ(catalog_->GetFamily("f")->version(), 0);
  EXPECT_THAT(catalog_->FinishChild("x", "blob"), Fails(Code::kAborted, "'x'"));
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  const Job import = MustSubmitImport("e");
  EXPECT_THAT(catalog_->FinishChild(MustLease().lease_id, "blob"),
              Fails(Code::kInvalidArgument, import.id()));
}

TEST_P(CatalogSuite, AChildThatFailsForGoodFailsItsRegistration) {
  const Job job = MustSubmitThreeTargets();
  FinishNextChild();
  const Lease second = MustLease(), third = MustLease();
  EXPECT_THAT(catalog_->FailJob(third.lease_id, absl::DataLossError("frame 3 is bad"), false),
              Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_EQ(GetJob(job.id()).error().code(), static_cast<int>(Code::kDataLoss));
  EXPECT_EQ(GetJob(job.id()).error().message(), "target 'd': frame 3 is bad");
  EXPECT_TRUE(ChildrenOf(job).empty());
  EXPECT_TRUE(NothingToDo());
  EXPECT_THAT(catalog_->Heartbeat(second.lease_id, kLease, {}),
              Fails(Code::kAborted, second.lease_id));
  EXPECT_THAT(catalog_->FinishChild(second.lease_id, "late"),
              Fails(Code::kAborted, second.lease_id));
  EXPECT_THAT(catalog_->DeleteJob(job.id()), Succeeds());
}

TEST_P(CatalogSuite, AChildIsTriedAgainLikeAnyJob) {
  const Job job = MustSubmitThreeTargets();
  const Job first = FailNext(absl::InternalError("odd"));
  EXPECT_NE(MustLease().job.id(), first.id());  // that one is left alone for a second
  now_ += absl::Seconds(1);
  const Lease again = MustLease();
  EXPECT_EQ(again.job.id(), first.id());
  EXPECT_EQ(again.job.attempts(), 2);
  EXPECT_THAT(catalog_->ReleaseJob(again.lease_id), Succeeds());
  EXPECT_EQ(ChildrenOf(job)[0].attempts(), 1);
  EXPECT_EQ(GetJob(job.id()).state(), Job::WAITING);
}

TEST_P(CatalogSuite, AChildOfALostWorkerIsGivenToAnother) {
  const Job job = MustSubmitThreeTargets();
  const Lease old = MustLease("paused");
  now_ += kLease;
  const Lease current = MustLease("other");
  EXPECT_EQ(current.job.id(), old.job.id());
  EXPECT_EQ(current.job.attempts(), 2);
  EXPECT_THAT(catalog_->FinishChild(old.lease_id, "blob"), Fails(Code::kAborted, old.lease_id));
  EXPECT_THAT(catalog_->FinishChild(current.lease_id, "blob"), Succeeds());
  EXPECT_THAT(catalog_->FinishChild(current.lease_id, "blob"),
              Fails(Code::kAborted, current.lease_id));
  EXPECT_EQ(ChildrenOf(job)[0].state(), Job::SUCCEEDED);
}

TEST_P(CatalogSuite, AChildThatLosesItsWorkersFailsItsRegistration) {
  const Job job = MustSubmitThreeTargets();
  for (int k = 0; k < 2; ++k) FinishNextChild();
  for (int attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(MustLease("worker 9").job.attempts(), attempt);
    now_ += kLease;
    if (attempt != 2) continue;
    EXPECT_TRUE(NothingToDo());
    now_ += absl::Seconds(2);
  }
  EXPECT_TRUE(NothingToDo());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_THAT(GetJob(job.id()).error().message(), ::testing::StartsWith("target 'd': "));
  EXPECT_THAT(GetJob(job.id()).error().message(),
              ::testing::HasSubstr("lost 3 times, last on worker 9"));
  ASSERT_EQ(GetJob(job.id()).failed_attempts_size(), 3);
  EXPECT_EQ(GetJob(job.id()).failed_attempts(0).error().message(),
            "target 'd': the worker was lost");
}

TEST_P(CatalogSuite, CancelsARegistrationWithAllItsChildren) {
  const Job job = MustSubmitThreeTargets();
  FinishNextChild();
  const Lease running = MustLease();
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
  EXPECT_TRUE(NothingToDo());
  EXPECT_THAT(catalog_->Heartbeat(running.lease_id, kLease, {}),
              Fails(Code::kAborted, running.lease_id));
  EXPECT_THAT(catalog_->FinishChild(running.lease_id, "blob"),
              Fails(Code::kAborted, running.lease_id));
  EXPECT_TRUE(ChildrenOf(job).empty());
  MustSubmitRegistration("f", "a", {"b", "c"});
}

TEST_P(CatalogSuite, CancelsARegistrationWhoseResultsArePutTogether) {
  const Job job = MustSubmitThreeTargets();
  for (int k = 0; k < 3; ++k) FinishNextChild();
  const Lease lease = MustLease();
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_TRUE(catalog_->Heartbeat(lease.lease_id, kLease, {})->cancel_requested);
  EXPECT_THAT(catalog_->FailJob(lease.lease_id, absl::CancelledError("stopped"), false),
              Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
  EXPECT_TRUE(ChildrenOf(job).empty());
}

TEST_P(CatalogSuite, KeepsWhatAWaitingRegistrationNeeds) {
  const Job job = MustSubmitThreeTargets();
  FinishNextChild();
  EXPECT_THAT(catalog_->DeleteFamily("f"), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_THAT(catalog_->DeleteJob(job.id()), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_THAT(catalog_->DeleteAnimation("d"), Fails(Code::kFailedPrecondition, job.id()));
  EXPECT_THAT(catalog_->SubmitRegistration(RegistrationOf("f", "a", {"b"})),
              Fails(Code::kFailedPrecondition, job.id()));
  const Lease child = MustLease();
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  EXPECT_THAT(catalog_->DeleteAnimation("d"), Succeeds());
  EXPECT_THAT(catalog_->FinishChild(child.lease_id, "blob"), Fails(Code::kAborted, child.lease_id));
  EXPECT_THAT(catalog_->GetFamily("f"), Fails(Code::kNotFound, "'f'"));
}

TEST_P(CatalogSuite, NeedsTheChildrenBlobsUntilTheRegistrationEnds) {
  const Job job = MustSubmitThreeTargets();
  const std::vector<Job> children = ChildrenOf(job);
  FinishNextChild();
  EXPECT_THAT(*catalog_->ListReferencedBlobs(),
              ::testing::ElementsAre("blob-of-a", "blob-of-b", "blob-of-c", "blob-of-d",
                                     "blob-of-" + children[0].id()));
  FinishNextChild();
  FinishNextChild();
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

TEST_P(CatalogSuite, KeepsACheckpointThroughRetryReleaseAndLossOfTheLease) {
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  const Job job = MustSubmitRegistration("f", "a", {"b"});
  const Lease first = MustLease();
  EXPECT_EQ(first.job.checkpoint_blob(), "");
  EXPECT_THAT(catalog_->SaveCheckpoint(first.lease_id, "one"), Succeeds());
  EXPECT_THAT(catalog_->SaveCheckpoint(first.lease_id, "two"), Succeeds());
  EXPECT_THAT(catalog_->Heartbeat(first.lease_id, kLease, {}), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::RUNNING);
  EXPECT_THAT(catalog_->ReleaseJob(first.lease_id), Succeeds());
  const Lease released = MustLease();
  EXPECT_EQ(released.job.checkpoint_blob(), "two");
  EXPECT_THAT(catalog_->FailJob(released.lease_id, absl::UnavailableError("net"), true),
              Succeeds());
  now_ += absl::Minutes(1);  // the pause before another attempt
  const Lease retried = MustLease();
  EXPECT_EQ(retried.job.checkpoint_blob(), "two");
  now_ += kLease;  // lost
  const Lease current = MustLease();
  EXPECT_EQ(current.job.checkpoint_blob(), "two");
  EXPECT_THAT(catalog_->SaveCheckpoint(retried.lease_id, "late"),
              Fails(Code::kAborted, retried.lease_id));
  EXPECT_EQ(GetJob(job.id()).checkpoint_blob(), "two");
}

TEST_P(CatalogSuite, NeedsACheckpointUntilItIsReplacedOrTheJobEnds) {
  const auto needed = [&](const std::string& blob) {
    const std::vector<std::string> blobs = *catalog_->ListReferencedBlobs();
    return std::count(blobs.begin(), blobs.end(), blob) > 0;
  };
  const Job three = MustSubmitThreeTargets();
  const Lease child = MustLease(), other = MustLease();
  EXPECT_THAT(catalog_->SaveCheckpoint(child.lease_id, "one"), Succeeds());
  EXPECT_THAT(catalog_->SaveCheckpoint(other.lease_id, "other"), Succeeds());
  EXPECT_TRUE(needed("one") && needed("other"));
  EXPECT_THAT(catalog_->SaveCheckpoint(child.lease_id, "two"), Succeeds());
  EXPECT_TRUE(!needed("one") && needed("two"));
  EXPECT_THAT(catalog_->FinishChild(child.lease_id, "result"), Succeeds());
  EXPECT_TRUE(!needed("two") && needed("result"));
  EXPECT_EQ(ChildrenOf(three)[0].checkpoint_blob(), "");
  EXPECT_THAT(catalog_->RequestCancel(three.id()), Succeeds());
  EXPECT_FALSE(needed("other"));
  EXPECT_THAT(catalog_->SaveCheckpoint(other.lease_id, "late"),
              Fails(Code::kAborted, other.lease_id));

  for (const bool succeeds : {true, false}) {
    const Job one = MustSubmitRegistration("f", "a", {"b"});
    const Lease lease = MustLease();
    EXPECT_THAT(catalog_->SaveCheckpoint(lease.lease_id, "whole"), Succeeds());
    EXPECT_TRUE(needed("whole"));
    pb::FamilyRecord family;
    family.set_id("f");
    family.set_blob("family");
    EXPECT_THAT(succeeds ? catalog_->PublishFamily(lease.lease_id, family).status()
                         : catalog_->FailJob(lease.lease_id, absl::DataLossError("bad"), false),
                Succeeds());
    EXPECT_FALSE(needed("whole"));
    EXPECT_EQ(GetJob(one.id()).checkpoint_blob(), "");
  }
}

TEST_P(CatalogSuite, ARepeatedRequestAddsNoChildren) {
  for (const std::string id : {"a", "b", "c"}) MakeAnimation(id);
  const auto one = catalog_->SubmitRegistration(RegistrationOf("f", "a", {"b", "c"}, "request"));
  const auto two = catalog_->SubmitRegistration(RegistrationOf("f", "a", {"b", "c"}, "request"));
  ASSERT_THAT(one, Succeeds());
  ASSERT_THAT(two, Succeeds());
  EXPECT_EQ(one->id(), two->id());
  EXPECT_EQ(ChildrenOf(*one).size(), 2);
  MustLease();
  MustLease();
  EXPECT_TRUE(NothingToDo());
}

// Four threads finish eight children as fast as they can; whoever finishes the last one, one of
// them gets the registration, and none before.
TEST_P(CatalogSuite, ThreadsFinishChildrenUntilTheRegistrationIsQueuedOnce) {
  std::vector<std::string> targets;
  for (int k = 0; k < 8; ++k) {
    MakeAnimation(targets.emplace_back(absl::StrCat("a", k)));
  }
  const Job job = MustSubmitRegistration("f", "a0", targets);
  std::atomic<int> num_children = 0, num_wholes = 0;
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
          EXPECT_EQ(num_children, 8);
          ++num_wholes;
        } else {
          ++num_children;
          EXPECT_THAT(catalog->FinishChild((*lease)->lease_id, "blob"), Succeeds());
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_children, 8);
  EXPECT_EQ(num_wholes, 1);
}

}  // namespace liquidblend::store

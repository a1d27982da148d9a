// CatalogSuite: the queue, alone and with several workers at once. Included by catalog_suite.h.
#pragma once

#include <fstream>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

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

TEST_P(CatalogSuite, AClockThatIsTurnedBackHoldsUpNoLostJobForLong) {
  MustSubmitImport("a");
  const Lease old = MustLease();
  now_ -= absl::Hours(24);
  const Lease current = MustLease();
  EXPECT_EQ(current.job.id(), old.job.id());
  EXPECT_THAT(catalog_->Heartbeat(old.lease_id, kLease, {}), Fails(Code::kAborted, old.lease_id));
  EXPECT_THAT(catalog_->Heartbeat(current.lease_id, absl::Hours(1), {}), Succeeds());
  now_ -= absl::Seconds(1);
  EXPECT_EQ(MustLease().job.id(), old.job.id());
  EXPECT_THAT(catalog_->ReleaseJob(current.lease_id), Fails(Code::kAborted, current.lease_id));
}

TEST_P(CatalogSuite, WaitsForAJob) {
  const auto idle = catalog_->WaitForJob(absl::Milliseconds(1));
  ASSERT_THAT(idle, Succeeds());
  EXPECT_FALSE(*idle);
  std::thread thread([&] { MustSubmitImport("a"); });
  bool is_woken = false;
  while (!is_woken) {
    const auto woken = catalog_->WaitForJob(absl::Seconds(10));
    ASSERT_THAT(woken, Succeeds());
    is_woken = *woken;
  }
  thread.join();
  EXPECT_EQ(MustLease().job.attempts(), 1);
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

TEST_P(CatalogSuite, CountsHowOftenAJobWasHandedBackAndWhetherThatWasInVain) {
  const Job job = MustSubmitImport("a");
  const auto hand_back = [&](const std::string& checkpoint) {
    const Lease lease = MustLease();
    now_ += absl::Seconds(1);
    if (!checkpoint.empty()) {
      EXPECT_THAT(catalog_->SaveCheckpoint(lease.lease_id, checkpoint), Succeeds());
    }
    EXPECT_THAT(catalog_->ReleaseJob(lease.lease_id), Succeeds());
    now_ += absl::Seconds(1);
    return std::pair(GetJob(job.id()).handed_back(), GetJob(job.id()).handed_back_in_vain());
  };
  EXPECT_EQ(hand_back(""), std::pair(1, 1));
  EXPECT_EQ(hand_back(""), std::pair(2, 2));
  EXPECT_EQ(hand_back("one"), std::pair(3, 0));
  EXPECT_EQ(hand_back(""), std::pair(4, 1)) << "the checkpoint is an earlier attempt's";
  EXPECT_EQ(GetJob(job.id()).checkpoint_time().seconds(), 1700000005);
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

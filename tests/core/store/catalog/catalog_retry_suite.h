// CatalogSuite: attempts, and the pauses between them. Included by catalog_suite.h.
#pragma once

#include <algorithm>
#include <string>

#include "absl/time/clock.h"
#include "core/store/catalog/job_records.h"
#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

TEST_P(CatalogSuite, RetriesWithGrowingPausesWhileAttemptsAreLeft) {
  const Job job = MustSubmitImport("a");
  EXPECT_EQ(FailNext(absl::InternalError("odd")).attempts(), 1);
  EXPECT_EQ(GetJob(job.id()).state(), Job::QUEUED);
  EXPECT_EQ(GetJob(job.id()).next_attempt_time().seconds(), 1700000001);
  EXPECT_EQ(GetAnimation("a").state(), Animation::IMPORTING);
  now_ += absl::Milliseconds(999);
  EXPECT_TRUE(NothingToDo());
  now_ += absl::Milliseconds(1);
  EXPECT_EQ(FailNext(absl::InternalError("odd")).attempts(), 2);
  now_ += absl::Milliseconds(1999);
  EXPECT_TRUE(NothingToDo());
  now_ += absl::Milliseconds(1);
  EXPECT_FALSE(MustLease().job.has_next_attempt_time());
  now_ += kLease;
  EXPECT_TRUE(NothingToDo());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_THAT(GetJob(job.id()).error().message(), ::testing::HasSubstr("after 3 attempts"));
}

TEST_P(CatalogSuite, FailsWithTheErrorOfTheLastAttempt) {
  const Job job = MustSubmitImport("a");
  for (const std::string error : {"one", "two", "three"}) {
    FailNext(absl::InternalError(error));
    now_ += absl::Seconds(2);
  }
  EXPECT_TRUE(NothingToDo());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_EQ(GetJob(job.id()).error().message(), "three");
  EXPECT_EQ(GetAnimation("a").error().message(), "three");
}

TEST_P(CatalogSuite, KeepsTheErrorOfEachAttempt) {
  const Job job = MustSubmitImport("a");
  MustLease("one");
  now_ += kLease;
  EXPECT_THAT(catalog_->FailJob(MustLease("two").lease_id, absl::UnavailableError("net"), true),
              Succeeds());
  now_ += absl::Seconds(1);
  EXPECT_THAT(catalog_->FailJob(MustLease("three").lease_id, absl::DataLossError("bad"), false),
              Succeeds());
  const Job failed = GetJob(job.id());
  ASSERT_EQ(failed.failed_attempts_size(), 3);
  EXPECT_EQ(failed.failed_attempts(0).worker(), "one");
  EXPECT_TRUE(failed.failed_attempts(0).worker_lost());
  EXPECT_EQ(failed.failed_attempts(0).end_time().seconds(), 1700000030);
  EXPECT_EQ(failed.failed_attempts(1).worker(), "two");
  EXPECT_EQ(failed.failed_attempts(1).error().code(), static_cast<int>(Code::kUnavailable));
  EXPECT_EQ(failed.failed_attempts(1).error().message(), "net");
  EXPECT_EQ(failed.failed_attempts(2).worker(), "three");
  EXPECT_EQ(failed.failed_attempts(2).error().message(), "bad");
  EXPECT_FALSE(failed.failed_attempts(2).worker_lost());
  EXPECT_EQ(failed.failed_attempts(2).end_time().seconds(), 1700000031);
}

TEST_P(CatalogSuite, GivesALostJobToAnotherAtOnceTheFirstTimeOnly) {
  const Job poison = MustSubmitImport("poison");
  MustSubmitImport("next");
  EXPECT_EQ(MustLease("worker 9").job.id(), poison.id());
  now_ += kLease;
  EXPECT_EQ(MustLease("worker 9").job.attempts(), 2);
  now_ += kLease;
  const Lease next = MustLease();
  EXPECT_EQ(next.job.import_animation().animation(), "next");
  EXPECT_EQ(GetJob(poison.id()).state(), Job::QUEUED);
  EXPECT_EQ(GetJob(poison.id()).next_attempt_time().seconds(), 1700000062);
  now_ += absl::Seconds(2);
  EXPECT_EQ(MustLease("worker 9").job.attempts(), 3);
  EXPECT_THAT(catalog_->PublishAnimation(next.lease_id, AnimationCalled("next")), Succeeds());
  now_ += kLease;
  EXPECT_TRUE(NothingToDo());
  const Job job = GetJob(poison.id());
  EXPECT_EQ(job.state(), Job::FAILED);
  EXPECT_EQ(job.error().code(), static_cast<int>(Code::kInternal));
  EXPECT_THAT(job.error().message(), ::testing::HasSubstr("lost 3 times, last on worker 9"));
  EXPECT_EQ(GetAnimation("poison").state(), Animation::FAILED);
  EXPECT_EQ(GetAnimation("poison").error().message(), job.error().message());
}

// Workers of a farm may be killed more often than a job may be tried.
TEST_P(CatalogSuite, ALossAfterANewCheckpointUsesUpNoAttempt) {
  const Job job = MustSubmitImport("a");
  for (int k = 0; k < 5; ++k) {
    const Lease lease = MustLease();
    EXPECT_EQ(lease.job.attempts(), 1) << k;
    EXPECT_EQ(lease.job.losses_after_progress(), k);
    EXPECT_THAT(catalog_->SaveCheckpoint(lease.lease_id, "blob"), Succeeds());
    now_ += kLease;
    EXPECT_TRUE(k == 0 || NothingToDo());  // the first loss is followed by no pause
    now_ += absl::Minutes(1);
  }
  for (int k = 0; k < 2; ++k) {  // no new one: the job harms its workers
    MustLease();
    now_ += kLease;
    EXPECT_TRUE(NothingToDo());
    now_ += absl::Minutes(1);
  }
  MustLease();
  now_ += kLease;
  EXPECT_TRUE(NothingToDo());
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_THAT(GetJob(job.id()).error().message(), ::testing::HasSubstr("after 3 attempts"));
}

TEST_P(CatalogSuite, LossesAfterNewCheckpointsAreNoFailuresOfTheEnvironment) {
  CatalogOptions options = Options();
  options.retry.max_environment_failures = 2;
  catalog_ = backend_->Open(options);
  const Job job = MustSubmitImport("a");
  for (int k = 0; k < 5; ++k) {
    EXPECT_THAT(catalog_->SaveCheckpoint(MustLease().lease_id, "blob"), Succeeds());
    now_ += kLease + absl::Minutes(1);
  }
  FailNext(absl::UnavailableError("net"));
  EXPECT_EQ(GetJob(job.id()).state(), Job::QUEUED);
  EXPECT_EQ(GetJob(job.id()).environment_failures(), 1);
  now_ += absl::Seconds(1);  // the pause after the first failure
  EXPECT_EQ(AttemptNumber(MustLease().job), 7);
}

TEST_P(CatalogSuite, AnAttemptKnowsWhenItsJobWasQueued) {
  const absl::Time submitted = now_;
  MustSubmitImport("a");
  now_ += absl::Seconds(7);
  Lease lease = MustLease();
  EXPECT_EQ(ToTime(lease.job.queue_time()), submitted);
  now_ += absl::Seconds(2);
  const absl::Time handed_back = now_;
  EXPECT_THAT(catalog_->ReleaseJob(lease.lease_id), Succeeds());
  now_ += absl::Seconds(3);
  lease = MustLease();
  EXPECT_EQ(ToTime(lease.job.queue_time()), handed_back);
  now_ += kLease;
  EXPECT_EQ(ToTime(MustLease().job.queue_time()), now_) << "its worker was lost";
}

TEST_P(CatalogSuite, FailuresOfTheEnvironmentUseUpNoAttempts) {
  CatalogOptions options = Options();
  options.retry.max_environment_failures = 25;
  catalog_ = backend_->Open(options);
  const Job job = MustSubmitImport("a");
  for (int k = 1; k < 25; ++k) {
    const bool is_disk = k % 2 == 0;
    FailNext(is_disk ? absl::ResourceExhaustedError("disk full") : absl::UnavailableError("net"));
    ASSERT_EQ(GetJob(job.id()).state(), Job::QUEUED) << k;
    const absl::Duration pause = absl::Seconds(std::min(300, 1 << (k - 1)));
    now_ += pause - absl::Microseconds(1);
    ASSERT_TRUE(NothingToDo()) << k;
    now_ += absl::Microseconds(1);
  }
  EXPECT_EQ(GetJob(job.id()).attempts(), 0);
  EXPECT_EQ(GetJob(job.id()).environment_failures(), 24);
  EXPECT_EQ(GetJob(job.id()).failed_attempts_size(), 20);  // the newest
  EXPECT_EQ(GetJob(job.id()).failed_attempts(19).error().message(), "disk full");
  FailNext(absl::UnavailableError("still no net"));
  EXPECT_EQ(GetJob(job.id()).state(), Job::FAILED);
  EXPECT_EQ(GetJob(job.id()).error().message(), "still no net");
}

TEST_P(CatalogSuite, PausesDifferByTheJitter) {
  const auto pause = [&](const std::string& id, double random) {
    const Job job = MustSubmitImport(id);
    random_ = random;
    EXPECT_EQ(FailNext(absl::InternalError("odd")).id(), job.id());
    const auto next = GetJob(job.id()).next_attempt_time();
    return absl::FromUnixSeconds(next.seconds()) + absl::Nanoseconds(next.nanos()) - now_;
  };
  EXPECT_EQ(pause("a", 0.0), absl::Milliseconds(750));
  EXPECT_EQ(pause("b", 0.5), absl::Seconds(1));
  EXPECT_EQ(pause("c", 0.75), absl::Milliseconds(1125));
}

TEST_P(CatalogSuite, CancelsAJobThatWaitsForItsNextAttempt) {
  const Job job = MustSubmitImport("a");
  FailNext(absl::InternalError("odd"));
  EXPECT_THAT(catalog_->RequestCancel(job.id()), Succeeds());
  EXPECT_EQ(GetJob(job.id()).state(), Job::CANCELLED);
  now_ += absl::Hours(1);
  EXPECT_TRUE(NothingToDo());
}

TEST_P(CatalogSuite, AClockThatIsTurnedBackHoldsUpNoRetryForLong) {
  MustSubmitImport("a");
  FailNext(absl::InternalError("odd"));
  now_ -= absl::Hours(24);
  EXPECT_EQ(MustLease().job.attempts(), 2);
}

// By the real clock: nobody tells that a pause is over, or that a lease has run out.
TEST_P(CatalogSuite, WakesWhenAPauseIsOverAndWhenALeaseRunsOut) {
  CatalogOptions options;
  options.retry.first_pause = absl::Milliseconds(100);
  const auto catalog = backend_->Open(options);
  ASSERT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  const auto first = catalog->LeaseJob("one", kLease);
  ASSERT_TRUE(first.ok() && first->has_value());
  ASSERT_THAT(catalog->FailJob((*first)->lease_id, absl::InternalError("odd"), true), Succeeds());
  const auto take = [&] {
    const absl::Time begin = absl::Now();
    while (absl::Now() - begin < absl::Seconds(4)) {  // below any poll for its own sake
      EXPECT_THAT(catalog->WaitForJob(begin + absl::Seconds(4) - absl::Now()), Succeeds());
      const auto lease = catalog->LeaseJob("two", absl::Milliseconds(200));
      EXPECT_THAT(lease, Succeeds());
      if (lease.ok() && lease->has_value()) return (*lease)->job.attempts();
    }
    return 0;
  };
  EXPECT_EQ(take(), 2);
  EXPECT_EQ(take(), 3);
}

}  // namespace liquidblend::store

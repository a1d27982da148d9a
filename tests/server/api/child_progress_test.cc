#include "server/api/child_progress.h"

#include <gtest/gtest.h>

#include "core/store/catalog/catalog.h"

namespace liquidblend::server {
namespace {

using store::v1::JobRecord;

JobRecord Child(int target_index, JobRecord::State state, double fraction, double seconds_elapsed,
                double seconds_left) {
  JobRecord child;
  child.set_state(state);
  child.set_attempts(state == JobRecord::QUEUED ? 0 : target_index + 1);
  child.set_worker(state == JobRecord::RUNNING ? "worker" + std::to_string(target_index) : "");
  child.mutable_register_target()->set_target_index(target_index);
  child.mutable_progress()->set_stage(state == JobRecord::QUEUED ? "" : "registration");
  child.mutable_progress()->set_fraction(fraction);
  child.mutable_progress()->set_iteration(10 * target_index);
  child.mutable_progress()->set_seconds_elapsed(seconds_elapsed);
  child.mutable_progress()->set_seconds_left(seconds_left);
  return child;
}

JobRecord Waiting() {
  JobRecord job;
  job.set_id("register-1");
  job.set_state(JobRecord::WAITING);
  return job;
}

TEST(ChildProgress, TellsWhenChildrenThatAllWaitAreTriedAgain) {
  JobRecord done = Child(0, JobRecord::SUCCEEDED, 1.0, 8, 0);
  JobRecord late = Child(1, JobRecord::QUEUED, 0, 0, 0);
  JobRecord soon = Child(2, JobRecord::QUEUED, 0, 0, 0);
  late.mutable_next_attempt_time()->set_seconds(20);
  soon.mutable_next_attempt_time()->set_seconds(10);
  soon.set_environment_failures(2);
  soon.add_failed_attempts()->mutable_error()->set_message("no S3");
  const JobRecord job = WithProgressOf({done, late, soon}, Waiting());
  EXPECT_EQ(job.next_attempt_time().seconds(), 10);
  EXPECT_EQ(job.environment_failures(), 2);
  EXPECT_EQ(job.failed_attempts(0).error().message(), "no S3");
  const JobRecord fresh = Child(3, JobRecord::QUEUED, 0, 0, 0);
  EXPECT_FALSE(WithProgressOf({soon, fresh}, Waiting()).has_next_attempt_time());
}

TEST(ChildProgress, IsTheMeanAndTheDetailsOfTheSlowest) {
  const JobRecord job = WithProgressOf(
      {Child(0, JobRecord::SUCCEEDED, 1.0, 8, 0), Child(1, JobRecord::RUNNING, 0.75, 6, 2),
       Child(2, JobRecord::RUNNING, 0.25, 3, 9)},
      Waiting());
  EXPECT_EQ(job.id(), "register-1");
  EXPECT_EQ(job.state(), JobRecord::WAITING);
  EXPECT_DOUBLE_EQ(job.progress().fraction(), store::kChildrenShare * 2 / 3);
  EXPECT_EQ(job.progress().stage(), "registration");
  EXPECT_EQ(job.progress().target_index(), 2);
  EXPECT_EQ(job.progress().iteration(), 20);
  EXPECT_EQ(job.attempts(), 3);
  EXPECT_EQ(job.worker(), "worker2");
  EXPECT_EQ(job.progress().seconds_elapsed(), 8);
  EXPECT_EQ(job.progress().seconds_left(), 9);  // that of the slowest: nothing else is queued
}

TEST(ChildProgress, CountsHowOftenChildrenWereHandedBack) {
  JobRecord done = Child(0, JobRecord::SUCCEEDED, 1.0, 8, 0);
  JobRecord first = Child(1, JobRecord::QUEUED, 0, 0, 0);
  JobRecord second = Child(2, JobRecord::QUEUED, 0, 0, 0);
  done.set_handed_back(9);
  done.set_handed_back_in_vain(9);
  first.set_handed_back(4);
  first.set_handed_back_in_vain(1);
  second.set_handed_back(3);
  second.set_handed_back_in_vain(2);
  const JobRecord job = WithProgressOf({done, first, second}, Waiting());
  EXPECT_EQ(job.handed_back(), 16);
  EXPECT_EQ(job.handed_back_in_vain(), 2);
}

TEST(ChildProgress, TimeLeftCountsWhatIsQueued) {
  // A child takes 10 s; one and a half are left for the only one that runs.
  const JobRecord job = WithProgressOf(
      {Child(0, JobRecord::RUNNING, 0.5, 5, 5), Child(1, JobRecord::QUEUED, 0, 0, 0)}, Waiting());
  EXPECT_DOUBLE_EQ(job.progress().seconds_left(), 15);
  EXPECT_EQ(job.progress().target_index(), 0);
}

TEST(ChildProgress, TimeLeftIsUnknownWhileOneDoesNotKnow) {
  const JobRecord job = WithProgressOf(
      {Child(0, JobRecord::RUNNING, 0.5, 5, 5), Child(1, JobRecord::RUNNING, 0.01, 1, 0)},
      Waiting());
  EXPECT_EQ(job.progress().seconds_left(), 0);
}

TEST(ChildProgress, HasNoStageWhileNoneRuns) {
  const JobRecord job = WithProgressOf(
      {Child(0, JobRecord::QUEUED, 0, 0, 0), Child(1, JobRecord::SUCCEEDED, 1, 4, 0)}, Waiting());
  EXPECT_EQ(job.progress().stage(), "");
  EXPECT_EQ(job.attempts(), 0);
  EXPECT_DOUBLE_EQ(job.progress().fraction(), store::kChildrenShare / 2);
}

TEST(ChildProgress, IsTheJobsOwnOnceItHasSome) {
  JobRecord job = Waiting();
  job.set_state(JobRecord::RUNNING);
  job.set_worker("assembler");
  const JobRecord begun = WithProgressOf({Child(0, JobRecord::SUCCEEDED, 1, 4, 0)}, job);
  EXPECT_DOUBLE_EQ(begun.progress().fraction(), store::kChildrenShare);
  EXPECT_EQ(begun.worker(), "assembler");
  job.mutable_progress()->set_stage("publishing");
  job.mutable_progress()->set_fraction(0.97);
  const JobRecord shown = WithProgressOf({Child(0, JobRecord::SUCCEEDED, 1, 4, 0)}, job);
  EXPECT_EQ(shown.SerializeAsString(), job.SerializeAsString());
  EXPECT_EQ(WithProgressOf({}, job).SerializeAsString(), job.SerializeAsString());
}

}  // namespace
}  // namespace liquidblend::server

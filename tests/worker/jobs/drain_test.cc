// Workers that leave by themselves: when there is nothing to do, or after so many jobs.
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/steady_cond_var.h"
#include "tests/worker/jobs/away_catalog.h"
#include "tests/worker/jobs/jobs_testing.h"
#include "worker/jobs/run_jobs.h"

namespace liquidblend::jobs {
namespace {

using store::Succeeds;
using store::pb::JobRecord;

class DrainTest : public JobsTest {
 protected:
  static JobLoopOptions WithIdleTime(absl::Duration idle_time) {
    JobLoopOptions options = Options();
    options.idle_time = idle_time;
    options.poll = absl::Milliseconds(5);
    return options;
  }
};

TEST_F(DrainTest, LeavesOnceThereWasNothingToDoForItsIdleTime) {
  const std::string job = SubmitBall("ball", 1.0);
  const auto begin = base::SteadyClock::now();
  ASSERT_THAT(WorkWith(WithIdleTime(absl::Milliseconds(100))), Succeeds());
  EXPECT_GE(base::Since(begin), absl::Milliseconds(100));
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
}

TEST_F(DrainTest, DoesAJobThatComesInItsIdleTime) {
  std::jthread worker([this] {
    JobLoopOptions options = WithIdleTime(absl::Minutes(10));
    options.max_jobs = 1;
    EXPECT_THAT(WorkWith(options), Succeeds());
  });
  Await([this] { return !catalog_->ListWorkers()->empty(); });  // it has asked
  const std::string job = SubmitBall("ball", 1.0);
  worker.join();
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
}

// Another worker's job comes back to the queue while this one waits.
TEST_F(DrainTest, TakesTheJobOfAWorkerThatIsLostInItsIdleTime) {
  const std::string job = SubmitBall("ball", 1.0);
  ASSERT_TRUE((*catalog_->LeaseJob("lost", absl::Seconds(30))).has_value());
  std::jthread worker([this] {
    JobLoopOptions options = WithIdleTime(absl::Minutes(10));
    options.max_jobs = 1;
    EXPECT_THAT(WorkWith(options), Succeeds());
  });
  Await([this] { return catalog_->ListWorkers()->size() == 2; });
  EXPECT_EQ(Job(job).worker(), "lost");
  clock_ms_ += 30'000;
  worker.join();
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
}

// While the queue cannot be asked, nobody knows whether there is nothing to do.
TEST_F(DrainTest, TimeInWhichTheQueueIsAwayDoesNotCountAsIdle) {
  constexpr absl::Duration kIdleTime = absl::Milliseconds(300);
  int num_asked = 0;
  std::optional<base::SteadyClock::time_point> gone, back;
  AwayCatalog catalog(*catalog_);
  catalog.before = [&](const std::string& call) {
    if (call != "LeaseJob" || ++num_asked == 1) return absl::OkStatus();  // then it is idle
    const auto now = base::SteadyClock::now();
    if (!gone.has_value()) gone = now;
    if (absl::FromChrono(now - *gone) <= 2 * kIdleTime) throw std::bad_alloc();
    if (!back.has_value()) back = now;
    return absl::OkStatus();
  };
  ASSERT_THAT(RunJobs(catalog, blobs_, parallel::Arena(2), stop_, WithIdleTime(kIdleTime)),
              Succeeds());
  ASSERT_TRUE(back.has_value());
  EXPECT_GE(base::Since(*back), kIdleTime);
}

TEST_F(DrainTest, TakesNoMoreJobsThanItMay) {
  std::vector<std::string> jobs;
  for (const char* id : {"a", "b", "c"}) jobs.push_back(SubmitBall(id, 1.0));
  JobLoopOptions options = WithIdleTime(absl::InfiniteDuration());
  options.max_jobs = 2;
  ASSERT_THAT(WorkWith(options), Succeeds());
  EXPECT_EQ(Job(jobs[0]).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(jobs[1]).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(jobs[2]).state(), JobRecord::QUEUED);
}

// The end of the last child queues its parent, which is found by whoever ended it.
TEST_F(DrainTest, FinishesARegistrationOfSeveralTargets) {
  for (const char* id : {"a", "b", "c"}) SubmitBall(id, 1.0);
  ASSERT_THAT(Work(), Succeeds());
  const std::string job = SubmitRegistration("balls", "a", {"b", "c"});
  ASSERT_THAT(WorkWith(WithIdleTime(absl::ZeroDuration())), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED) << Job(job).error().message();
}

}  // namespace
}  // namespace liquidblend::jobs

#include "worker/jobs/attempt/publish.h"

#include "tests/worker/jobs/away_catalog.h"
#include "tests/worker/jobs/jobs_testing.h"

namespace liquidblend::jobs {
namespace {

const absl::Status kAway = absl::UnavailableError("the database is away");

class PublishTest : public JobsTest {
 protected:
  PublishTest() : job_id_(SubmitImport("drop", {})) {
    lease_options_.duration = absl::Seconds(1);
    lease_options_.report_interval = absl::Milliseconds(2);
    lease_ = **catalog_->LeaseJob("one", lease_options_.duration);
  }

  // Fails num_failures_ times, and calls after_failure_ each time.
  absl::Status PublishLate() {
    if (num_failures_ == 0) {
      store::pb::AnimationRecord animation;
      animation.set_id("drop");
      return catalog_->PublishAnimation(lease_.lease_id, animation);
    }
    --num_failures_;
    after_failure_();
    return error_;
  }
  absl::Status Publish(const PublishOptions& options) {
    LeaseKeeper keeper(*catalog_, lease_, stop_, lease_options_);
    return PublishWhileLeased(
        keeper, [&] { return PublishLate(); }, options);
  }

  static PublishOptions QuickOptions() {
    PublishOptions options;
    options.first_pause = absl::Milliseconds(5);
    options.longest_pause = absl::Milliseconds(10);
    return options;
  }

  const PublishOptions quick_ = QuickOptions();
  const std::string job_id_;
  LeaseOptions lease_options_;
  store::Lease lease_;
  int num_failures_ = 0;
  absl::Status error_ = kAway;
  std::function<void()> after_failure_ = [] {};
};

TEST_F(PublishTest, TriesAgainWhileTheCatalogIsAway) {
  num_failures_ = 3;
  EXPECT_TRUE(Publish(quick_).ok());
  EXPECT_EQ(Job(job_id_).state(), store::pb::JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(job_id_).attempts(), 1);
}

TEST_F(PublishTest, TriesAgainWhileTheDiskOfTheCatalogIsFull) {
  num_failures_ = 3;
  error_ = absl::ResourceExhaustedError("the disk of the database is full");
  EXPECT_TRUE(Publish(quick_).ok());
  EXPECT_EQ(Job(job_id_).state(), store::pb::JobRecord::SUCCEEDED);
}

// The catalog is away for longer than the lease. Nobody else has taken the job meanwhile.
TEST_F(PublishTest, GoesOnWhenTheLeaseCannotBeRenewed) {
  lease_options_.duration = absl::Milliseconds(100);
  AwayCatalog catalog(*catalog_);
  catalog.before = [&](const std::string& call) {
    return call == "Heartbeat" ? kAway : absl::OkStatus();
  };
  LeaseKeeper keeper(catalog, lease_, stop_, lease_options_);
  num_failures_ = 100'000;
  after_failure_ = [&] {
    if (!keeper.Check().ok()) num_failures_ = 0;
  };
  EXPECT_TRUE(PublishWhileLeased(
                  keeper, [&] { return PublishLate(); }, quick_)
                  .ok());
  EXPECT_TRUE(absl::IsUnavailable(keeper.Check()));
  EXPECT_EQ(Job(job_id_).state(), store::pb::JobRecord::SUCCEEDED);
}

// A failover, or a full disk, may take hours; so may what it would have to do again.
TEST_F(PublishTest, TriesForADay) {
  const PublishOptions options;
  EXPECT_EQ(options.longest, absl::Hours(24));
  EXPECT_LE(options.longest_pause, LeaseOptions().duration / 3);  // then it is quick to report
}

TEST_F(PublishTest, AWorkerThatIsRefusedDoesNotWaitHere) {
  num_failures_ = 2;
  error_ = absl::PermissionDeniedError("permission denied for table families");
  EXPECT_EQ(Publish(quick_), error_);
}

TEST_F(PublishTest, GivesUpAfterTheLongestTime) {
  num_failures_ = 1000;
  PublishOptions options = quick_;
  options.longest = absl::Seconds(2);
  EXPECT_EQ(Publish(options), kAway);
  EXPECT_LT(num_failures_, 999);
  EXPECT_EQ(Job(job_id_).state(), store::pb::JobRecord::RUNNING);
}

TEST_F(PublishTest, OtherErrorsAreNotTriedAgain) {
  LeaseKeeper keeper(*catalog_, lease_, stop_, lease_options_);
  int num_calls = 0;
  const auto publish = [&] {
    ++num_calls;
    return absl::AbortedError("the lease has ended");
  };
  EXPECT_TRUE(absl::IsAborted(PublishWhileLeased(keeper, publish, quick_)));
  EXPECT_EQ(num_calls, 1);
}

TEST_F(PublishTest, EndsWithTheLease) {
  num_failures_ = 100'000;
  after_failure_ = [&] {
    clock_ms_ += 2000;
    catalog_->LeaseJob("two", lease_options_.duration).IgnoreError();
  };
  EXPECT_TRUE(absl::IsAborted(Publish(quick_)));
}

TEST_F(PublishTest, EndsWhenTheWorkerIsToStop) {
  num_failures_ = 100'000;
  after_failure_ = [&] { stop_.Request(); };
  EXPECT_EQ(Publish(quick_), absl::UnavailableError("the worker is stopping"));
  EXPECT_EQ(Job(job_id_).state(), store::pb::JobRecord::QUEUED);
}

}  // namespace
}  // namespace liquidblend::jobs

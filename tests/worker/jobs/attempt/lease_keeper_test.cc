#include "worker/jobs/attempt/lease_keeper.h"

#include <atomic>
#include <new>

#include "absl/strings/str_cat.h"
#include "core/base/steady_cond_var.h"
#include "tests/worker/jobs/away_catalog.h"
#include "tests/worker/jobs/jobs_testing.h"

namespace liquidblend::jobs {
namespace {

class LeaseKeeperTest : public JobsTest {
 protected:
  LeaseKeeperTest() : job_id_(SubmitImport("drop", {})) {}

  store::Lease Take(const std::string& worker) {
    auto lease = catalog_->LeaseJob(worker, options_.duration);
    EXPECT_TRUE(lease.ok() && lease->has_value());
    return **lease;
  }

  static LeaseOptions QuickOptions() {
    LeaseOptions options;
    options.duration = absl::Seconds(1);
    options.report_interval = absl::Milliseconds(2);
    return options;
  }

  const LeaseOptions options_ = QuickOptions();
  const std::string job_id_;
};

// The catalog cuts longer leases: renewed every third of what was asked, they would lapse.
TEST(LeaseOptions, AreNoLongerThanTheCatalogGrants) {
  LeaseOptions options;
  options.duration = store::kLongestLease;
  EXPECT_TRUE(options.Validate().ok());
  options.duration = absl::Minutes(40);
  EXPECT_EQ(options.Validate(), absl::InvalidArgumentError("lease duration is above 10m: 40m"));
}

TEST_F(LeaseKeeperTest, TellsProgress) {
  LeaseKeeper keeper(*catalog_, Take("one"), stop_, options_);
  store::pb::JobProgress progress;
  progress.set_stage("registration");
  progress.set_iteration(3);
  keeper.Report(progress);
  Await([&] { return Job(job_id_).progress().iteration() == 3; });
  EXPECT_EQ(Job(job_id_).progress().stage(), "registration");
  EXPECT_TRUE(keeper.Check().ok());
}

// Its catalog would write 8 MiB for each of them.
TEST_F(LeaseKeeperTest, TellsProgressOfALongJobRarely) {
  const std::string long_id = SubmitImport("long", {{std::string(8 << 20, 'x'), {}}});
  LeaseOptions options = options_;
  options.duration = absl::Minutes(5);
  LeaseKeeper keeper(*catalog_, Take("one"), stop_, options);
  LeaseKeeper long_keeper(*catalog_, Take("two"), stop_, options);
  ASSERT_EQ(long_keeper.job().id(), long_id);
  for (int k = 1; k <= 20; ++k) {
    store::pb::JobProgress progress;
    progress.set_iteration(k);
    long_keeper.Report(progress);
    keeper.Report(progress);
    Await([&] { return Job(job_id_).progress().iteration() == k; });
  }
  EXPECT_EQ(Job(long_id).progress().iteration(), 0);
}

TEST_F(LeaseKeeperTest, TellsProgressOfALongJobWithEachRenewal) {
  const std::string long_id = SubmitImport("long", {{std::string(8 << 20, 'x'), {}}});
  Take("one");
  LeaseKeeper keeper(*catalog_, Take("two"), stop_, options_);
  store::pb::JobProgress progress;
  progress.set_iteration(7);
  keeper.Report(progress);
  Await([&] { return Job(long_id).progress().iteration() == 7; });
}

TEST_F(LeaseKeeperTest, RenewsTheLeaseOfSilentWork) {
  LeaseKeeper keeper(*catalog_, Take("one"), stop_, options_);
  clock_ms_ = 900;  // the lease ends at 1,000
  Await([&] { return Job(job_id_).update_time().nanos() == 900'000'000; });
  clock_ms_ = 1500;
  EXPECT_FALSE((*catalog_->LeaseJob("two", options_.duration)).has_value());
  EXPECT_TRUE(keeper.Check().ok());
}

// What the job allocates may leave no memory for the keeper's thread.
TEST_F(LeaseKeeperTest, GoesOnAfterFailedAllocations) {
  const store::Lease lease = Take("one");
  std::atomic<int> num_failures = 0;
  on_clock_ = [&] {
    if (num_failures < 3) {
      ++num_failures;
      throw std::bad_alloc();
    }
  };
  LeaseKeeper keeper(*catalog_, lease, stop_, options_);
  Await([&] {
    store::pb::JobProgress progress;
    progress.set_iteration(7);
    keeper.Report(progress);
    return Job(job_id_).progress().iteration() == 7;
  });
  EXPECT_EQ(num_failures, 3);
  EXPECT_TRUE(keeper.Check().ok());
}

TEST_F(LeaseKeeperTest, HearsOfCancellation) {
  LeaseKeeper keeper(*catalog_, Take("one"), stop_, options_);
  ASSERT_TRUE(catalog_->RequestCancel(job_id_).ok());
  Await([&] { return absl::IsCancelled(keeper.Check()); });
}

TEST_F(LeaseKeeperTest, NoticesThatTheLeaseIsLost) {
  LeaseKeeper keeper(*catalog_, Take("one"), stop_, options_);
  // No renewal may come between the two: then the second worker finds nothing, and tries again.
  Await([&] {
    clock_ms_ += 10'000;
    return (*catalog_->LeaseJob("two", absl::Hours(1000))).has_value();
  });
  Await([&] { return absl::IsAborted(keeper.Check()); });
  EXPECT_EQ(Job(job_id_).worker(), "two");
}

// Work that did not look meanwhile loses nothing by an outage.
TEST_F(LeaseKeeperTest, GoesOnIfTheLeaseIsRenewedAfterAll) {
  LeaseOptions options = options_;
  options.duration = absl::Milliseconds(100);
  std::atomic<bool> is_away = true;
  std::atomic<int> num_failures = 0, num_renewals = 0;
  AwayCatalog catalog(*catalog_);
  catalog.before = [&](const std::string&) {
    if (!is_away) {
      ++num_renewals;
      return absl::OkStatus();
    }
    ++num_failures;
    return absl::UnavailableError("the database is away");
  };
  LeaseKeeper keeper(catalog, Take("one"), stop_, options);
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  Await([&] { return base::Since(begin) > options.duration; });
  // The second renewal from here on begins after the end of the lease; the third one follows it.
  const int num_before = num_failures;
  Await([&] { return num_failures >= num_before + 3; });
  is_away = false;
  Await([&] { return num_renewals >= 2; });  // so the keeper knows of the first one
  EXPECT_THAT(keeper.Check(), store::Succeeds());
  // A second outage counts from that renewal.
  is_away = true;
  Await([&] { return !keeper.Check().ok(); });
  EXPECT_TRUE(absl::IsUnavailable(keeper.Check()));
}

// The lease may have run out, or the catalog may only have been away: it alone knows.
TEST_F(LeaseKeeperTest, TellsThatTheLeaseCouldNotBeRenewed) {
  LeaseOptions options = options_;
  options.duration = absl::Milliseconds(100);
  std::atomic<bool> is_away = true;
  AwayCatalog catalog(*catalog_);
  catalog.before = [&](const std::string&) {
    return is_away ? absl::UnavailableError("the database is away") : absl::OkStatus();
  };
  LeaseKeeper keeper(catalog, Take("one"), stop_, options);
  Await([&] { return !keeper.Check().ok(); });
  EXPECT_EQ(keeper.Check(),
            absl::UnavailableError(absl::StrCat("the lease of job '", job_id_,
                                                "' has run out: the database is away")));
  EXPECT_TRUE(keeper.CheckForPublishing().ok());
  EXPECT_FALSE(keeper.is_released());
  // It is renewed as soon as that is possible. The work has been told to end, and is to do so.
  clock_ms_ = 900;
  is_away = false;
  Await([&] { return Job(job_id_).update_time().nanos() == 900'000'000; });
  EXPECT_TRUE(absl::IsUnavailable(keeper.Check()));
  // Unless another worker was quicker.
  Await([&] {
    clock_ms_ += 10'000;
    return (*catalog_->LeaseJob("two", absl::Hours(1000))).has_value();
  });
  Await([&] { return absl::IsAborted(keeper.Check()); });
  EXPECT_TRUE(absl::IsAborted(keeper.CheckForPublishing()));
}

// No call about the job will succeed any more.
TEST_F(LeaseKeeperTest, EndsWhenTheTablesAreOfANewerProgram) {
  AwayCatalog catalog(*catalog_);
  catalog.before = [](const std::string&) {
    return absl::FailedPreconditionError("has schema version 8");
  };
  LeaseKeeper keeper(catalog, Take("one"), stop_, options_);
  keeper.Report({});
  Await([&] { return !keeper.Check().ok(); });
  EXPECT_EQ(keeper.Check(), absl::UnavailableError("has schema version 8"));
  EXPECT_EQ(keeper.CheckForPublishing(), keeper.Check());
  EXPECT_FALSE(keeper.is_released());
}

TEST_F(LeaseKeeperTest, GivesTheJobBackWhenTheWorkerIsToStop) {
  LeaseKeeper keeper(*catalog_, Take("one"), stop_, options_);
  stop_.Request();
  Await([&] { return absl::IsUnavailable(keeper.Check()); });
  EXPECT_TRUE(keeper.is_released());
  EXPECT_EQ(Job(job_id_).state(), store::pb::JobRecord::QUEUED);
  EXPECT_EQ(Job(job_id_).attempts(), 0);
}

TEST(LeaseOptions, NamesTheFirstFieldOutOfRange) {
  LeaseOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.duration = absl::Milliseconds(99);
  EXPECT_THAT(std::string(options.Validate().message()), testing::HasSubstr("duration"));
  options = LeaseOptions();
  options.report_interval = absl::ZeroDuration();
  EXPECT_THAT(std::string(options.Validate().message()), testing::HasSubstr("report_interval"));
}

TEST_F(LeaseKeeperTest, LetsTheWorkBeSavedBeforeTheJobGoesBack) {
  const store::Lease lease = Take("one");
  absl::Status saved = absl::UnknownError("not called");
  LeaseKeeper keeper(*catalog_, lease, stop_, options_, [&] {
    saved = catalog_->SaveCheckpoint(lease.lease_id, "blob");
    return "with a checkpoint";
  });
  stop_.Request();
  Await([&] { return !keeper.Check().ok(); });
  EXPECT_THAT(saved, store::Succeeds());
  EXPECT_EQ(Job(job_id_).state(), store::pb::JobRecord::QUEUED);
  EXPECT_EQ(Job(job_id_).checkpoint_blob(), "blob");
}

}  // namespace
}  // namespace liquidblend::jobs

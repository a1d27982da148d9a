// Leases that end while the catalog is away.
#include "core/store/catalog/job_queue.h"

#include "core/store/catalog/catalog_tables.h"
#include "core/store/catalog/outage_watch.h"
#include "core/store/sql/sqlite.h"
#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {
namespace {

constexpr absl::Duration kLease = absl::Seconds(30);

class JobQueueTest : public ::testing::Test {
 protected:
  JobQueueTest() {
    CatalogOptions options;
    options.now = [this] { return start_; };
    options.busy_timeout = absl::Milliseconds(1);
    catalog_ = *OpenSqliteCatalog(path_, options);
    db_ = *Database::Open(path_, absl::Seconds(10));
    EXPECT_THAT(catalog_->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
    const auto lease = catalog_->LeaseJob("one", kLease);
    EXPECT_TRUE(lease.ok() && lease->has_value());
    lease_ = **lease;
  }

  // Lease that a worker gets so long after the first one began.
  LeaseAttempt LeaseAfter(absl::Duration time, const Outage& outage) {
    LeaseRequest request{.worker = {}, .duration = kLease, .outage = outage};
    request.worker.set_name("two");
    request.worker.set_memory_bytes(kAnyMemory);
    LeaseAttempt attempt;
    EXPECT_THAT(db_->Transaction([&]() -> absl::Status {
      LB_ASSIGN_OR_RETURN(attempt, LeaseJob(*db_, request, RetryOptions(), start_ + time));
      return absl::OkStatus();
    }),
                Succeeds());
    return attempt;
  }
  Outage Away(absl::Duration begin, absl::Duration end) const {
    return {start_ + begin, start_ + end};
  }
  pb::JobRecord Job() { return *catalog_->GetJob(lease_.job.id()); }

  const absl::Time start_ = absl::FromUnixSeconds(1'700'000'000);
  const TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/catalog.db";
  std::unique_ptr<Catalog> catalog_;
  std::unique_ptr<Database> db_;
  Lease lease_;
};

TEST_F(JobQueueTest, ALeaseThatEndedWhileTheCatalogWasAwayIsRenewedOnce) {
  const Outage outage = Away(absl::Seconds(20), absl::Seconds(50));
  EXPECT_EQ(LeaseAfter(absl::Seconds(51), outage).next, LeaseAttempt::kTryAgain);
  EXPECT_EQ(LeaseAfter(absl::Seconds(52), outage).next, LeaseAttempt::kNothing);
  EXPECT_EQ(Job().worker(), "one");
  EXPECT_EQ(Job().attempts(), 1);
  EXPECT_THAT(FindLeasedJob(*db_, lease_.lease_id), Succeeds()) << "its worker goes on";
  // But if it never comes back, it is lost.
  EXPECT_EQ(LeaseAfter(absl::Seconds(81), outage).next, LeaseAttempt::kLease);
  EXPECT_EQ(Job().worker(), "two");
  EXPECT_EQ(Job().attempts(), 2);
  ASSERT_EQ(Job().failed_attempts_size(), 1);
  EXPECT_TRUE(Job().failed_attempts(0).worker_lost());
}

TEST_F(JobQueueTest, ALeaseThatEndsRightAfterTheOutageIsRenewed) {
  EXPECT_EQ(LeaseAfter(absl::Seconds(31), Away(absl::Seconds(5), absl::Seconds(25))).next,
            LeaseAttempt::kTryAgain);
}

TEST_F(JobQueueTest, ALeaseThatEndsLongAfterAnOutageOrBeforeItIsLost) {
  EXPECT_EQ(LeaseAfter(absl::Seconds(30), Away(absl::Seconds(5), absl::Seconds(15))).next,
            LeaseAttempt::kLease);
  EXPECT_EQ(LeaseAfter(absl::Seconds(90), Away(absl::Seconds(70), absl::Seconds(80))).next,
            LeaseAttempt::kLease);
  EXPECT_EQ(Job().failed_attempts_size(), 2);
}

TEST_F(JobQueueTest, AJobWithoutAttemptsLeftIsNotGivenUpForAnOutage) {
  LeaseAfter(absl::Seconds(30), Outage());
  LeaseAfter(absl::Seconds(60), Outage());
  LeaseAfter(absl::Seconds(120), Outage());
  ASSERT_EQ(Job().attempts(), 3);
  LeaseRequest request{
      .worker = {}, .duration = kLease, .outage = Away(absl::Seconds(140), absl::Seconds(160))};
  request.worker.set_memory_bytes(kAnyMemory);
  EXPECT_THAT(EndDeadJobs(*db_, request, RetryOptions(), start_ + absl::Seconds(161)), Succeeds());
  EXPECT_EQ(Job().state(), pb::JobRecord::RUNNING);
  request.outage = Outage();
  EXPECT_THAT(EndDeadJobs(*db_, request, RetryOptions(), start_ + absl::Seconds(161)), Succeeds());
  EXPECT_EQ(Job().state(), pb::JobRecord::FAILED);
}

// A catalog knows by itself when it was away.
TEST_F(JobQueueTest, CallsThatFailAreAnOutage) {
  CatalogOptions options;
  options.now = [this] { return start_ + kLease; };  // when the lease ends
  options.busy_timeout = absl::Milliseconds(1);
  const auto two = *OpenSqliteCatalog(path_, options);
  EXPECT_THAT(db_->Transaction([&] {
    EXPECT_THAT(two->Heartbeat("of a lease", kLease, {}),
                Fails(absl::StatusCode::kUnavailable, "locked"));
    return absl::OkStatus();
  }),
              Succeeds());
  const auto lease = two->LeaseJob("two", kLease);
  ASSERT_THAT(lease, Succeeds());
  EXPECT_FALSE(lease->has_value());
  EXPECT_EQ(Job().worker(), "one");
  // One that has met no outage.
  const auto three = (*OpenSqliteCatalog(path_, options))->LeaseJob("three", kLease);
  ASSERT_THAT(three, Succeeds());
  EXPECT_FALSE(three->has_value()) << "the lease was renewed";
}

TEST(OutageWatch, KnowsFromTheFirstFailedCallToTheLast) {
  const absl::Time now = absl::FromUnixSeconds(1'700'000'000);
  const auto ago = [](absl::Duration time) {
    return base::SteadyClock::now() - absl::ToChronoNanoseconds(time);
  };
  OutageWatch watch;
  watch.Note(ago(absl::Hours(9)), absl::OkStatus());
  watch.Note(ago(absl::Hours(9)), absl::NotFoundError("no such job"));
  EXPECT_GT(watch.Last(now).begin, watch.Last(now).end) << "none";
  watch.Note(ago(absl::Hours(8)), absl::UnavailableError("away"));
  watch.Note(ago(absl::Hours(1)), absl::ResourceExhaustedError("full"));
  EXPECT_NEAR(absl::ToDoubleHours(now - watch.Last(now).begin), 8, 0.5);
  EXPECT_NEAR(absl::ToDoubleHours(now - watch.Last(now).end), 0, 0.5);
}

}  // namespace
}  // namespace liquidblend::store

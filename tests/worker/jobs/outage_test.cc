// A job fails only for what is wrong with it: what happens to its attempts while the catalog is
// away.
#include <atomic>
#include <string>
#include <vector>

#include "core/store/sql/sqlite.h"
#include "tests/worker/jobs/away_catalog.h"
#include "tests/worker/jobs/jobs_testing.h"

namespace liquidblend::jobs {
namespace {

using store::Fails;
using store::Succeeds;
using store::pb::JobRecord;
using testing::HasSubstr;

const absl::Status kCatalogAway = absl::UnavailableError("the database is away");
const absl::Status kCatalogFull = absl::ResourceExhaustedError("the disk of the database is full");
const absl::Status kCatalogDenied = absl::PermissionDeniedError("permission denied for table jobs");

class OutageTest : public JobsTest {
 protected:
  static JobLoopOptions QuickOptions() {
    JobLoopOptions options = Options();
    options.poll = absl::Milliseconds(5);
    return options;
  }
  absl::Status WorkWith(store::Catalog& catalog, const JobLoopOptions& options = QuickOptions()) {
    const parallel::Arena arena(1);
    return RunJobs(catalog, blobs_, arena, stop_, options).status();
  }
  // Lets the first opening of a blob fail.
  void FailOnce() {
    blobs_.on_open = [this] {
      return ++num_opened_ == 1 ? absl::UnavailableError("S3 is away") : absl::OkStatus();
    };
  }

  AwayCatalog away_{*catalog_};
  std::atomic<int> num_opened_ = 0;
};

TEST_F(OutageTest, AFailureIsReportedOnceTheCatalogIsBackAndNoJobIsTakenBefore) {
  const std::string job = SubmitBall("a", 1.0);
  SubmitBall("b", 1.0);
  FailOnce();
  std::vector<absl::Status> answers = {kCatalogAway, kCatalogFull, kCatalogDenied, kCatalogAway,
                                       absl::OkStatus()};
  std::vector<std::string> calls;
  size_t num_reports = 0;
  away_.before = [&](const std::string& call) {
    if (call == "Heartbeat") return absl::OkStatus();  // of another thread
    if (call == "RecordWorker") return absl::OkStatus();
    calls.push_back(call);
    return call == "FailJob" ? answers.at(num_reports++) : absl::OkStatus();
  };
  EXPECT_THAT(WorkWith(away_), Succeeds());
  ASSERT_GT(calls.size(), answers.size() + 1);
  EXPECT_EQ(calls[0], "LeaseJob");
  for (size_t k = 1; k <= answers.size(); ++k) EXPECT_EQ(calls[k], "FailJob") << k;
  EXPECT_EQ(num_reports, answers.size());
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(job).attempts(), 1);
  EXPECT_EQ(Job(job).environment_failures(), 1);
}

TEST_F(OutageTest, AFailureThatIsNobodysAnyMoreIsNotReportedForEver) {
  const std::string job = SubmitBall("a", 1.0);
  FailOnce();
  int num_reports = 0;
  away_.before = [&](const std::string& call) {
    if (call != "FailJob" || ++num_reports > 2) return absl::OkStatus();
    if (num_reports == 1) return kCatalogAway;
    clock_ms_ += 60'000;
    EXPECT_TRUE((*catalog_->LeaseJob("another", absl::Minutes(5))).has_value());
    return kCatalogAway;
  };
  EXPECT_THAT(WorkWith(away_), Succeeds());
  EXPECT_EQ(num_reports, 3) << "the last one was answered by ABORTED";
  EXPECT_EQ(Job(job).worker(), "another");
}

TEST_F(OutageTest, AWorkerThatCannotReportAFailureCanBeStopped) {
  const std::string job = SubmitBall("a", 1.0);
  FailOnce();
  int num_reports = 0;
  away_.before = [&](const std::string& call) {
    if (call != "FailJob") return absl::OkStatus();
    if (++num_reports == 2) stop_.Request();
    return kCatalogAway;
  };
  EXPECT_THAT(WorkWith(away_), Succeeds());
  EXPECT_EQ(num_reports, 2);
  EXPECT_EQ(Job(job).state(), JobRecord::RUNNING);
}

TEST_F(OutageTest, AnAttemptWhoseLeaseRanOutWhileTheCatalogWasAwayIsReported) {
  const std::string job = SubmitBall("a", 1.0);
  std::atomic<bool> is_away = false;
  std::atomic<int> num_beats = 0, num_reports = 0;
  away_.before = [&](const std::string& call) {
    if (call == "Heartbeat") ++num_beats;
    if (call == "FailJob" && ++num_reports == 3) is_away = false;
    return is_away ? kCatalogAway : absl::OkStatus();
  };
  blobs_.on_open = [&] {
    if (++num_opened_ > 1) return absl::OkStatus();
    is_away = true;
    const base::SteadyClock::time_point begin = base::SteadyClock::now();
    Await([&] { return base::Since(begin) > absl::Milliseconds(200); });
    const int num_before = num_beats;
    Await([&] { return num_beats > num_before + 2; });
    return absl::OkStatus();
  };
  JobLoopOptions options = QuickOptions();
  options.lease.duration = absl::Milliseconds(100);
  EXPECT_THAT(WorkWith(away_, options), Succeeds());
  EXPECT_EQ(num_reports, 3);
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED) << Job(job).error().message();
  EXPECT_EQ(Job(job).attempts(), 1);
  ASSERT_EQ(Job(job).failed_attempts_size(), 1);
  EXPECT_FALSE(Job(job).failed_attempts(0).worker_lost());
  EXPECT_THAT(Job(job).failed_attempts(0).error().message(), HasSubstr("has run out"));
}

TEST_F(OutageTest, AResultWaitsUntilTheDiskOfTheCatalogHasRoom) {
  const std::string job = SubmitBall("a", 1.0);
  int num_published = 0;
  away_.before = [&](const std::string& call) {
    return call == "PublishAnimation" && ++num_published == 1 ? kCatalogFull : absl::OkStatus();
  };
  EXPECT_THAT(WorkWith(away_), Succeeds());
  EXPECT_EQ(num_published, 2);
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(job).failed_attempts_size(), 0);
}

// It would be refused whatever it has made. With this program started anew, or a newer one, it goes
// on.
TEST_F(OutageTest, AWorkerOfAnOlderProgramEnds) {
  const std::string job = SubmitBall("a", 1.0);
  const auto db = *store::Database::Open(store::CatalogPath(folder_.path()), absl::Seconds(10));
  ASSERT_THAT(
      db->RunScript(absl::StrCat("PRAGMA user_version = ", store::SqliteTablesVersion() + 1)),
      Succeeds());
  EXPECT_THAT(Work(), Fails(absl::StatusCode::kFailedPrecondition, "has schema version"));
  EXPECT_EQ(Job(job).state(), JobRecord::QUEUED);
}

}  // namespace
}  // namespace liquidblend::jobs

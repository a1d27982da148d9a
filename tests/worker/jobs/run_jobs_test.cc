#include "worker/jobs/run_jobs.h"

#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <new>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/posix_file.h"
#include "core/store/blobs/mapped_file.h"
#include "core/store/files/files.h"
#include "tests/allocation_testing.h"
#include "tests/worker/jobs/away_catalog.h"
#include "tests/worker/jobs/jobs_testing.h"

namespace liquidblend::jobs {
namespace {

using store::Fails;
using store::Succeeds;
using store::pb::AnimationRecord;
using store::pb::JobRecord;
using testing::HasSubstr;

class RunJobsTest : public JobsTest {
 protected:
  absl::Status WorkWithin(int64_t memory_bytes) {
    JobLoopOptions options = Options();
    options.memory_bytes = memory_bytes;
    return WorkWith(std::move(options));
  }
};

TEST_F(RunJobsTest, AnImportPublishesTheAnimation) {
  const std::string job = SubmitBall("ball", 1.0);
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED) << Job(job).error().message();
  EXPECT_EQ(Job(job).progress().fraction(), 1.0);
  const AnimationRecord record = *catalog_->GetAnimation("ball");
  EXPECT_EQ(record.state(), AnimationRecord::READY);
  EXPECT_EQ(record.manifest().num_frames(), 4);
  EXPECT_EQ(record.manifest().frames_per_second(), 24);
  EXPECT_EQ(record.num_vertices(), 4 * 162);
  EXPECT_EQ(record.num_triangles(), 4 * 320);

  const auto blob = blobs_.Open(record.blob());
  ASSERT_THAT(blob, Succeeds());
  EXPECT_EQ(record.size_bytes(), static_cast<int64_t>((*blob)->bytes().size()));
  const auto animation = store::ReadAnimation(**blob, "ball");
  ASSERT_THAT(animation, Succeeds());
  EXPECT_EQ(animation->frames[3].vertices, Ball(1.0).frames[3].vertices);
}

TEST_F(RunJobsTest, BadInputFailsAtOnceAndSaysWhere) {
  std::vector<ingest::LoadedFile> files = ingest::Files(Ball(1.0), ingest::Format::kPly);
  files[2].bytes.resize(files[2].bytes.size() / 2);
  const std::string job = SubmitImport("ball", files);
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::FAILED);
  EXPECT_EQ(Job(job).attempts(), 1);
  EXPECT_THAT(Job(job).error().message(), HasSubstr(files[2].name));
  EXPECT_EQ(catalog_->GetAnimation("ball")->state(), AnimationRecord::FAILED);
}

// Files of its own go, as they count for nobody from now on; those that a client has sent to the
// store itself may be named by another import.
TEST_F(RunJobsTest, AFailedImportLeavesNoFiles) {
  AnimationRecord animation;
  animation.set_id("ball");
  JobRecord job;
  job.mutable_import_animation()->set_animation("ball");
  for (const bool sent_directly : {false, true}) {
    const auto file = blobs_.CreateUpload();
    ASSERT_THAT(file, Succeeds());
    store::pb::SourceFile& record = *job.mutable_import_animation()->add_files();
    record.set_name(sent_directly ? "f2.ply" : "f1.ply");
    record.set_blob(*(*file)->Commit());
    record.set_sent_directly(sent_directly);
  }
  const auto submitted = catalog_->SubmitImport(animation, job);
  ASSERT_THAT(submitted, Succeeds());
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(submitted->id()).state(), JobRecord::FAILED);
  const auto left = blobs_.List();
  ASSERT_THAT(left, Succeeds());
  ASSERT_EQ(left->size(), 1);
  EXPECT_EQ(left->front().id, job.import_animation().files(1).blob());
}

TEST_F(RunJobsTest, AnImportThatUsesUpItsAttemptsLeavesNoFiles) {
  AnimationRecord animation;
  animation.set_id("ball");
  JobRecord job;
  job.mutable_import_animation()->set_animation("ball");
  const auto file = blobs_.CreateUpload();
  ASSERT_THAT(file, Succeeds());
  store::pb::SourceFile& record = *job.mutable_import_animation()->add_files();
  record.set_name("f1.ply");
  record.set_blob(*(*file)->Commit());
  const auto submitted = catalog_->SubmitImport(animation, job);
  ASSERT_THAT(submitted, Succeeds());
  size_t num_left_before = 0;
  blobs_.on_open = [&] {
    num_left_before = blobs_.List()->size();
    return absl::InternalError("odd");
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(submitted->id()).state(), JobRecord::FAILED);
  EXPECT_GT(Job(submitted->id()).attempts(), 1);
  EXPECT_EQ(num_left_before, 1) << "at the last attempt";
  EXPECT_TRUE(blobs_.List()->empty());
}

// The disk fails after a file was opened: nothing that reads as zeros is published, and the user's
// file is not called bad input.
TEST_F(RunJobsTest, AFileThatCannotBeReadAnyMoreIsNeitherPublishedNorBlamed) {
  store::SurviveUnreadablePages();
  const std::string job = SubmitBall("ball", 1.0);
  blobs_.after_open = [&](const store::BlobId& id) {
    std::filesystem::resize_file(store::LocalBlobPath(folder_.path(), id), 0);
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).error().code(), static_cast<int>(absl::StatusCode::kDataLoss));
  EXPECT_THAT(Job(job).error().message(), HasSubstr("the disk may be failing"));
  EXPECT_NE(catalog_->GetAnimation("ball")->state(), AnimationRecord::READY);
}

TEST_F(RunJobsTest, ALostFileFailsAtOnceByName) {
  const std::vector<ingest::LoadedFile> files = ingest::Files(Ball(1.0), ingest::Format::kPly);
  const std::string job = SubmitImport("ball", files);
  ASSERT_TRUE(blobs_.Delete(*store::PutBlob(blobs_, files[1].bytes)).ok());
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::FAILED);
  EXPECT_EQ(Job(job).attempts(), 1);
  EXPECT_THAT(Job(job).error().message(), HasSubstr(files[1].name));
}

TEST_F(RunJobsTest, TroubleThatPassesIsWaitedOut) {
  const std::string job = SubmitBall("ball", 1.0);
  int num_opened = 0;
  blobs_.on_open = [&] {
    return ++num_opened == 1 ? absl::UnavailableError("disk is away") : absl::OkStatus();
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(job).attempts(), 1);
  EXPECT_EQ(Job(job).environment_failures(), 1);
}

// ---- a worker that is refused

class RefusedTest : public RunJobsTest {
 protected:
  // Works, and once the worker says that it is refused lets it in.
  void WorkUntilLetIn(const std::function<void()>& look_at_refused) {
    std::jthread worker([this] { EXPECT_THAT(Work(), Succeeds()); });
    Await([&] { return !Refusal().empty(); });
    look_at_refused();
    is_refused_ = false;
  }
  std::string Refusal() {
    const auto workers = catalog_->ListWorkers();
    return workers.ok() && !workers->empty() ? workers->front().refusal() : "";
  }
  absl::Status Access() const {
    return is_refused_ ? absl::PermissionDeniedError("PUT s3://bucket/x: HTTP status 403")
                       : absl::OkStatus();
  }
  std::atomic<bool> is_refused_ = true;
};

TEST_F(RefusedTest, TakesNoMoreJobsUntilItIsLetInAgain) {
  std::vector<std::string> jobs;
  for (const char* id : {"a", "b", "c"}) jobs.push_back(SubmitBall(id, 1.0));
  blobs_.on_create = [&] { return Access(); };
  WorkUntilLetIn([&] {
    EXPECT_THAT(Refusal(), HasSubstr("HTTP status 403"));
    EXPECT_EQ(Job(jobs[0]).state(), JobRecord::QUEUED);
    EXPECT_EQ(Job(jobs[0]).attempts(), 0);
    EXPECT_EQ(Job(jobs[0]).environment_failures(), 1);
    for (const size_t k : {1, 2}) {
      EXPECT_EQ(Job(jobs[k]).state(), JobRecord::QUEUED);
      EXPECT_EQ(Job(jobs[k]).failed_attempts_size(), 0);
    }
  });
  for (const std::string& job : jobs) {
    EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED) << Job(job).error().message();
    EXPECT_EQ(Job(job).attempts(), 1);
  }
  EXPECT_EQ(Job(jobs[0]).environment_failures(), 1);
  EXPECT_EQ(Refusal(), "");
}

TEST_F(RefusedTest, AReadOnlyDiskIsARefusal) {
  const std::string job = SubmitBall("ball", 1.0);
  blobs_.on_create = [&] {
    return is_refused_ ? base::ErrnoStatus(EROFS, "create", "/data/tmp/1") : absl::OkStatus();
  };
  WorkUntilLetIn([&] { EXPECT_THAT(Refusal(), HasSubstr("/data/tmp/1")); });
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
}

TEST_F(RefusedTest, AWorkerThatStartsRefusedTakesNoJob) {
  const std::string job = SubmitBall("ball", 1.0);
  blobs_.on_create = [&] { return Access(); };
  JobLoopOptions options = Options();
  options.refusal = Access();
  const parallel::Arena arena(1);
  std::jthread worker(
      [&] { EXPECT_THAT(RunJobs(*catalog_, blobs_, arena, stop_, options), Succeeds()); });
  Await([&] { return !Refusal().empty(); });
  EXPECT_EQ(Job(job).failed_attempts_size(), 0);
  is_refused_ = false;
  worker.join();
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(job).failed_attempts_size(), 0);
}

TEST_F(RefusedTest, AWorkerThatIsRefusedCanBeStopped) {
  SubmitBall("ball", 1.0);
  blobs_.on_create = [&] { return Access(); };
  WorkUntilLetIn([&] { stop_.Request(); });
}

// S3 refuses it all the time, so it notices without a lease.
TEST_F(RefusedTest, AWorkerThatIsRefusedEndsOnceTheTablesAreOfANewerProgram) {
  SubmitBall("ball", 1.0);
  blobs_.on_create = [&] { return Access(); };
  std::atomic<bool> has_ended = false;
  std::jthread worker([&] {
    EXPECT_THAT(Work(), Fails(absl::StatusCode::kFailedPrecondition, "has schema version"));
    has_ended = true;
  });
  Await([&] { return !Refusal().empty(); });
  const auto db = *store::Database::Open(store::CatalogPath(folder_.path()), absl::Seconds(10));
  ASSERT_THAT(
      db->RunScript(absl::StrCat("PRAGMA user_version = ", store::SqliteTablesVersion() + 1)),
      Succeeds());
  Await([&] { return has_ended.load(); });
  stop_.Request();
}

// It is a refusal as well, and passes.
TEST_F(RefusedTest, AWorkerThatTheCatalogRefusesWaits) {
  const std::string job = SubmitBall("ball", 1.0);
  std::atomic<int> num_refused = 0;
  AwayCatalog catalog(*catalog_);
  catalog.before = [&](const std::string& call) {
    const bool is_refused = (call == "LeaseJob" || call == "RecordWorker") && num_refused < 5;
    if (is_refused) ++num_refused;
    return is_refused ? absl::PermissionDeniedError("permission denied for table workers")
                      : absl::OkStatus();
  };
  const parallel::Arena arena(1);
  EXPECT_THAT(RunJobs(catalog, blobs_, arena, stop_, Options()), Succeeds());
  EXPECT_EQ(num_refused, 5);
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(job).failed_attempts_size(), 0);
}

TEST(Access, TellsPrintableAndShortReasons) {
  EXPECT_EQ(RefusalOf(absl::PermissionDeniedError("a\nb\xff")), "a?b?");
  EXPECT_EQ(RefusalOf(absl::PermissionDeniedError("")), "refused");
  EXPECT_EQ(RefusalOf(absl::PermissionDeniedError(std::string(1000, 'x'))).size(), 300);
}

TEST_F(RunJobsTest, OutOfMemoryFailsTheJobNotTheWorker) {
  const std::string first = SubmitBall("first", 1.0);
  blobs_.on_open = []() -> absl::Status { throw std::bad_alloc(); };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(first).state(), JobRecord::FAILED);
  EXPECT_EQ(Job(first).attempts(), 1);
  EXPECT_EQ(Job(first).error().code(), static_cast<int>(absl::StatusCode::kResourceExhausted));
  EXPECT_THAT(Job(first).error().message(), HasSubstr("out of memory in stage 'opening files'"));

  blobs_.on_open = nullptr;
  const std::string second = SubmitBall("second", 1.0);
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(second).state(), JobRecord::SUCCEEDED);
}

// Far more than the ball needs, and far less than what it is made to allocate.
constexpr int64_t kLimitBytes = 256 << 20;

TEST_F(RunJobsTest, AJobThatNeedsFarMoreThanEstimatedFailsAtOnce) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  const std::string large = SubmitBall("large", 1.0);
  std::vector<std::vector<char>> held;
  blobs_.on_open = [&] {
    held.emplace_back(kLimitBytes / 2);
    return absl::OkStatus();
  };
  ASSERT_THAT(WorkWithin(kLimitBytes), Succeeds());
  EXPECT_LT(held.size(), 3);
  held.clear();
  EXPECT_EQ(Job(large).state(), JobRecord::FAILED);
  EXPECT_EQ(Job(large).attempts(), 1);
  EXPECT_EQ(Job(large).environment_failures(), 0);
  EXPECT_EQ(Job(large).error().code(), static_cast<int>(absl::StatusCode::kResourceExhausted));
  EXPECT_EQ(Job(large).error().message(),
            "out of memory in stage 'opening files': the job may allocate 256 MiB on this worker; "
            "there is no estimate");

  blobs_.on_open = nullptr;
  const std::string small = SubmitBall("small", 1.0);
  ASSERT_THAT(WorkWithin(kLimitBytes), Succeeds());
  EXPECT_EQ(Job(small).state(), JobRecord::SUCCEEDED) << Job(small).error().message();
}

// Whatever allocation it is that fails, in the job's threads, in TBB or in a library.
TEST_F(RunJobsTest, RunningOutOfMemoryAnywhereHarmsNeitherWorkerNorQueue) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  SubmitBall("slow", 1.0);
  SubmitBall("fast", 2.0);
  ASSERT_THAT(Work(), Succeeds());
  int num_failed = 0, num_done = 0;
  for (int64_t limit = 1 << 20; limit <= 256 << 20; limit += limit / 4) {
    const std::string id = SubmitRegistration(absl::StrCat("family", limit), "slow", {"fast"});
    ASSERT_THAT(WorkWithin(limit), Succeeds());
    const JobRecord job = Job(id);
    if (job.state() == JobRecord::SUCCEEDED) {
      ++num_done;
      continue;
    }
    ++num_failed;
    EXPECT_EQ(job.state(), JobRecord::FAILED) << limit;
    EXPECT_EQ(job.error().code(), static_cast<int>(absl::StatusCode::kResourceExhausted))
        << limit << ": " << job.error().message();
    EXPECT_EQ(job.attempts(), 1) << limit << ": " << job.error().message();
  }
  EXPECT_GT(num_failed, 0);
  EXPECT_GT(num_done, 0);
}

TEST_F(RunJobsTest, OutOfMemoryBetweenJobsIsWaitedOut) {
  const std::string job = SubmitBall("ball", 1.0);
  int num_failures = 0;
  on_clock_ = [&] {
    if (num_failures < 2) {
      ++num_failures;
      throw std::bad_alloc();
    }
  };
  JobLoopOptions options = Options();
  options.poll = absl::Milliseconds(1);
  ASSERT_THAT(WorkWith(std::move(options)), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(job).attempts(), 1);
}

// While this lives, no thread can start: no address space has room for its stack.
class NoThreads {
 public:
  NoThreads() {
    pthread_getattr_default_np(&former_);
    pthread_attr_t huge = former_;
    pthread_attr_setstacksize(&huge, size_t{1} << 46);
    pthread_setattr_default_np(&huge);
  }
  ~NoThreads() { pthread_setattr_default_np(&former_); }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;

 private:
  pthread_attr_t former_;
};

TEST_F(RunJobsTest, AJobWhoseKeeperCannotStartGoesBackToTheQueue) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  const std::string job = SubmitBall("ball", 1.0);
  std::optional<NoThreads> no_threads(std::in_place);
  int num_looks = 0;
  on_clock_ = [&] {
    if (++num_looks == 6) no_threads.reset();  // after at least one attempt
  };
  ASSERT_THAT(Work(/*num_threads=*/1), Succeeds());
  EXPECT_FALSE(no_threads.has_value());
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(job).attempts(), 1);
  EXPECT_GE(Job(job).environment_failures(), 1);
}

TEST_F(RunJobsTest, MissingThreadsAndFilesAreTroubleOfTheEnvironment) {
  const std::string job = SubmitBall("ball", 1.0);
  int num_opened = 0;
  blobs_.on_open = [&] {
    if (++num_opened == 1) throw std::system_error(EAGAIN, std::generic_category(), "thread");
    return absl::OkStatus();
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(job).attempts(), 1);
  EXPECT_EQ(Job(job).environment_failures(), 1);
}

TEST_F(RunJobsTest, WhatOthersThrowFailsTheJobWithItsText) {
  const std::string job = SubmitBall("ball", 1.0);
  blobs_.on_open = []() -> absl::Status { throw std::runtime_error("who knows"); };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::FAILED);
  EXPECT_THAT(Job(job).error().message(), HasSubstr("who knows"));
}

TEST_F(RunJobsTest, ACancelledJobStopsAtTheNextStage) {
  const std::string job = SubmitBall("ball", 1.0);
  std::atomic<int> num_renewals = 0;
  AwayCatalog catalog(*catalog_);
  catalog.before = [&](const std::string& call) {
    if (call == "Heartbeat") ++num_renewals;
    return absl::OkStatus();
  };
  blobs_.on_open = [&] {
    EXPECT_TRUE(catalog_->RequestCancel(job).ok());
    // The keeper hears of it with its next renewal, and has noted that before the one after.
    const int num_before = num_renewals;
    Await([&] { return num_renewals >= num_before + 2; });
    return absl::OkStatus();
  };
  JobLoopOptions options = Options();
  options.lease.duration = absl::Milliseconds(100);
  ASSERT_THAT(RunJobs(catalog, blobs_, parallel::Arena(2), stop_, options), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::CANCELLED);
  EXPECT_NE(catalog_->GetAnimation("ball")->state(), AnimationRecord::READY);
}

TEST_F(RunJobsTest, AStoppedWorkerGivesItsJobBack) {
  const std::string job = SubmitBall("ball", 1.0);
  blobs_.on_open = [&] {
    stop_.Request();
    Await([&] { return Job(job).state() == JobRecord::QUEUED; });
    return absl::OkStatus();
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::QUEUED);
  EXPECT_EQ(Job(job).attempts(), 0);
  EXPECT_EQ(Job(job).handed_back(), 1);
}

TEST_F(RunJobsTest, ALostJobIsLeftToItsNewWorker) {
  const std::string job = SubmitBall("ball", 1.0);
  store::Lease other;
  blobs_.on_open = [&] {
    if (!other.lease_id.empty()) return absl::OkStatus();
    Await([&] {
      clock_ms_ += 3'600'000;
      auto lease = catalog_->LeaseJob("other", absl::Hours(100'000));
      if (lease.ok() && lease->has_value()) other = **lease;
      return !other.lease_id.empty();
    });
    return absl::OkStatus();
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::RUNNING);
  EXPECT_EQ(Job(job).worker(), "other");
  EXPECT_TRUE(catalog_->Heartbeat(other.lease_id, absl::Hours(1), {}).ok());
}

TEST_F(RunJobsTest, ARegistrationPublishesAFamilyThatCanBeOpened) {
  SubmitBall("slow", 1.0);
  SubmitBall("fast", 3.0);
  ASSERT_THAT(Work(), Succeeds());
  const std::string job = SubmitRegistration("balls", "slow", {"fast"});
  ASSERT_THAT(Work(), Succeeds());
  ASSERT_EQ(Job(job).state(), JobRecord::SUCCEEDED) << Job(job).error().message();
  const store::pb::FamilyRecord record = *catalog_->GetFamily("balls");
  EXPECT_EQ(record.version(), 1);
  EXPECT_EQ(record.manifest().source(), "slow");
  EXPECT_EQ(record.manifest().reports_size(), 1);
  auto blob = blobs_.Open(record.blob());
  ASSERT_THAT(blob, Succeeds());
  const auto family = store::OpenFamily(*blob, "balls");
  ASSERT_THAT(family, Succeeds());
  EXPECT_EQ(family->num_frames, 4);
  EXPECT_EQ(family->targets[0].name, "fast");
  EXPECT_EQ(record.num_vertices(), static_cast<int64_t>(family->vertices.size()));
  EXPECT_EQ(record.num_cells(), family->num_cells());
  // The fast ball ends at 3 m/s * 3 / 24 s + 0.5 m; one edge length is left around it.
  EXPECT_GT(family->domain_max[0], 0.875);
  EXPECT_LT(family->domain_max[0], 0.875 + 0.25);
  EXPECT_LT(family->domain_min[1], -0.49);
}

TEST_F(RunJobsTest, SpaceTimeOptionsShapeTheFamily) {
  SubmitBall("slow", 1.0);
  SubmitBall("fast", 3.0);
  ASSERT_THAT(Work(), Succeeds());
  SubmitRegistration("tracked", "slow", {"fast"},
                     [](auto& job) { job.mutable_space_time()->set_coarser_levels(0); });
  SubmitRegistration("rebuilt", "slow", {"fast"}, [](auto& job) {
    job.mutable_space_time()->set_connectivity(store::pb::REBUILT);
    job.mutable_space_time()->set_coarser_levels(3);
    job.mutable_space_time()->set_droplet_vertices(0);  // the ball has 162
  });
  const std::string bad = SubmitRegistration(
      "bad", "slow", {"fast"}, [](auto& job) { job.mutable_options()->set_thin_sheets_from(2); });
  ASSERT_THAT(Work(), Succeeds());
  const store::pb::FamilyManifest tracked = catalog_->GetFamily("tracked")->manifest();
  const store::pb::FamilyManifest rebuilt = catalog_->GetFamily("rebuilt")->manifest();
  EXPECT_EQ(tracked.coarser_levels_size(), 0);
  EXPECT_EQ(rebuilt.coarser_levels_size(), 3);
  EXPECT_EQ(tracked.num_first_vertices(), 162);  // the frame's own
  EXPECT_GT(rebuilt.num_first_vertices(), 0);
  EXPECT_NE(rebuilt.num_first_vertices(), 162);
  ASSERT_EQ(tracked.space_time_reports_size(), 2);
  ASSERT_EQ(rebuilt.space_time_reports_size(), 2);
  EXPECT_EQ(tracked.space_time_reports(0).connectivity(), store::pb::TRACKED);
  EXPECT_LT(tracked.space_time_reports(1).fidelity().max_distance_edges(), 1e-5);
  EXPECT_EQ(rebuilt.space_time_reports(0).connectivity(), store::pb::REBUILT);
  EXPECT_EQ(rebuilt.space_time_reports(1).fidelity().num_frames(), 4);
  EXPECT_LT(rebuilt.space_time_reports(1).fidelity().mean_distance_edges(), 0.05);
  EXPECT_EQ(Job(bad).state(), JobRecord::FAILED);
  EXPECT_EQ(Job(bad).error().message(), "thin_sheets_from is 2, not in [0, 1]");
}

TEST_F(RunJobsTest, ARefinementGoesOnFromThePublishedVersion) {
  SubmitBall("slow", 1.0);
  SubmitBall("fast", 3.0);
  ASSERT_THAT(Work(), Succeeds());
  SubmitRegistration("balls", "slow", {"fast"});
  ASSERT_THAT(Work(), Succeeds());
  const auto refine = [&](int64_t version,
                          const std::function<void(store::pb::RegisterJob&)>& change = {}) {
    const std::string job = SubmitRegistration("balls", "slow", {"fast"}, [&](auto& registration) {
      registration.set_refine_version(version);
      store::pb::Correspondence& top = *registration.add_correspondences()->add_correspondences();
      top.set_kind(store::pb::Correspondence::POINT);
      top.set_hard(true);
      for (const double value : {1.0 / 24, 0.0, 0.5, 1.0 / 24}) top.add_source(value);
      for (const double value : {3.0 / 24, 0.0, 0.5, 1.0 / 24}) top.add_target(value);
      if (change) change(registration);
    });
    EXPECT_THAT(Work(), Succeeds());
    return Job(job);
  };
  const JobRecord refined = refine(1);
  ASSERT_EQ(refined.state(), JobRecord::SUCCEEDED) << refined.error().message();
  const store::pb::FamilyRecord record = *catalog_->GetFamily("balls");
  EXPECT_EQ(record.version(), 2);
  EXPECT_EQ(record.manifest().reports(0).num_iterations(), 3);
  const store::pb::CorrespondenceReport& report = record.manifest().reports(0).correspondences(0);
  EXPECT_FALSE(report.overruled());
  EXPECT_LT(report.residual_m(), 1e-4);
  EXPECT_DOUBLE_EQ(report.correspondence().target(0), 3.0 / 24);

  EXPECT_THAT(refine(1).error().message(), HasSubstr("is at version 2 by now"));
  EXPECT_THAT(refine(2, [](auto& job) { job.set_source("fast"), job.set_targets(0, "slow"); })
                  .error()
                  .message(),
              HasSubstr("is of slow -> fast, which cannot be refined into fast -> slow"));
  EXPECT_THAT(refine(2,
                     [](auto& job) {
                       job.mutable_space_time()->set_connectivity(store::pb::REBUILT);
                       job.mutable_space_time()->set_droplet_vertices(0);
                     })
                  .error()
                  .message(),
              HasSubstr("options of space-time meshes"));
}

TEST_F(RunJobsTest, AFamilyHasTheSameBytesForAnyNumberOfThreads) {
  SubmitBall("slow", 1.0);
  SubmitBall("fast", 3.0);
  ASSERT_THAT(Work(), Succeeds());
  std::vector<std::string> blobs;
  for (const int num_threads : {1, 2, 8}) {
    SubmitRegistration("balls", "slow", {"fast"});
    ASSERT_THAT(Work(num_threads), Succeeds());
    blobs.push_back(catalog_->GetFamily("balls")->blob());  // named by content
  }
  EXPECT_EQ(blobs[0], blobs[1]);
  EXPECT_EQ(blobs[0], blobs[2]);
  EXPECT_EQ(catalog_->GetFamily("balls")->version(), 3);
}

TEST_F(RunJobsTest, AnimationsOfDifferentFrameRatesAreNotRegistered) {
  SubmitBall("a", 1.0, 24);
  SubmitBall("b", 1.0, 25);
  ASSERT_THAT(Work(), Succeeds());
  const std::string job = SubmitRegistration("balls", "a", {"b"});
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::FAILED);
  EXPECT_EQ(Job(job).attempts(), 1);
  EXPECT_EQ(catalog_->GetFamily("balls")->version(), 0);
}

TEST(JobLoopOptions, NamesTheFirstFieldOutOfRange) {
  const auto message = [](auto change) {
    JobLoopOptions options;
    change(options);
    return std::string(options.Validate().message());
  };
  EXPECT_TRUE(JobLoopOptions().Validate().ok());
  EXPECT_THAT(message([](auto& o) { o.worker.clear(); }), HasSubstr("worker"));
  EXPECT_THAT(message([](auto& o) { o.poll = absl::ZeroDuration(); }), HasSubstr("poll"));
  EXPECT_THAT(message([](auto& o) { o.idle_time = absl::Seconds(-1); }), HasSubstr("idle_time"));
  EXPECT_THAT(message([](auto& o) { o.max_jobs = -1; }), HasSubstr("max_jobs"));
  EXPECT_THAT(message([](auto& o) { o.lease.duration = absl::ZeroDuration(); }),
              HasSubstr("duration"));
}

}  // namespace
}  // namespace liquidblend::jobs

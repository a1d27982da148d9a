// Workers that are killed or stopped in mid-registration: another one goes on from the last
// checkpoint, and the family is the same bytes.
#include <signal.h>

#include <algorithm>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/base/status_macros.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "tests/e2e/e2e_testing.h"
#include "tests/synthetic/implicit.h"
#include "tests/worker/ingest/formats/encode_files.h"
#include "worker/jobs/checkpoint_file.h"

namespace liquidblend::e2e {
namespace {

using store::pb::JobRecord;

constexpr int kEvery = 2;  // iterations

class CheckpointTest : public E2eTest {
 protected:
  // One checkpoint every kEvery iterations; dies at a point, if one is given.
  static std::vector<std::string> Often(const std::string& fault_point = "") {
    std::vector<std::string> environment = {"LIQUIDBLEND_CHECKPOINT_INTERVAL=1ms"};
    if (!fault_point.empty()) environment.push_back("LIQUIDBLEND_FAULT_POINT=" + fault_point);
    return environment;
  }

  // balls: a -> targets, by one worker that nothing happens to. Returns the family's file, which is
  // called by its content.
  std::string RegisterUndisturbed(const std::vector<std::string>& targets) {
    Process worker = StartWorker();
    double velocity = 1.0;
    ExpectSuccess(AwaitDone(ImportBall("a", velocity).name()));
    for (const std::string& target : targets) {
      ExpectSuccess(AwaitDone(ImportBall(target, velocity += 1.0).name()));
    }
    ExpectSuccess(AwaitDone(Submit(targets).name()));
    return FamilyBlob();
  }

  Operation Submit(const std::vector<std::string>& targets) {
    v1::RegistrationOptions options = Iterations(num_iterations_);
    options.set_sample_share(1.0);
    options.set_node_spacing_edges(node_spacing_edges_);
    Operation registration;
    const grpc::Status status = Register(options, registration, targets);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return registration;
  }

  std::string FamilyBlob() { return catalog()->GetFamily("balls")->blob(); }

  // The workers' own view of an operation: the job, or, of several targets, its children.
  std::vector<JobRecord> JobsOf(const Operation& operation) {
    const std::string id = operation.name().substr(std::string("operations/").size());
    const auto children = catalog()->ListChildren(id);
    if (children.ok() && !children->empty()) return *children;
    return {*catalog()->GetJob(id)};
  }

  // Waits until one of them is in this state.
  JobRecord AwaitJob(const Operation& operation, const std::function<bool(const JobRecord&)>& is) {
    JobRecord found;
    Await([&] {
      const std::vector<JobRecord> jobs = JobsOf(operation);
      const auto job = std::find_if(jobs.begin(), jobs.end(), is);
      if (job != jobs.end()) found = *job;
      return job != jobs.end();
    });
    return found;
  }

  // Seconds of work, so that something can happen in the middle of it.
  void TakeLonger() {
    num_iterations_ = 200;
    node_spacing_edges_ = 1.3;
  }

  // Of a job that nobody works on: the iteration that its checkpoint is of.
  absl::StatusOr<int> CheckpointedIteration(const Operation& operation) {
    LB_ASSIGN_OR_RETURN(const auto blobs, store::OpenLocalBlobStore(data()));
    LB_ASSIGN_OR_RETURN(const auto blob, blobs->Open(JobsOf(operation)[0].checkpoint_blob()));
    LB_ASSIGN_OR_RETURN(const auto checkpoint, jobs::ReadCheckpoint(*blob, "the checkpoint"));
    const auto* const state = std::get_if<registration::IterationState>(&checkpoint.state);
    if (state == nullptr) return absl::FailedPreconditionError("all iterations are done");
    return state->last.iteration;
  }

  static bool IsResumed(const JobRecord& job) { return job.progress().resumed_iteration() > 0; }

  // Drops at these places above a pool.
  Operation ImportDrops(const std::string& id, const std::vector<double>& drops_x_m) {
    synthetic::FallingDropsOptions options;
    for (const double x : drops_x_m) options.drops.push_back({.centre_m = {x, 0, 0.8}});
    options.pool_half_width_m = {1.2, 0.4};
    options.num_frames = 4;
    std::vector<NamedBytes> files;
    for (const ingest::LoadedFile& file :
         ingest::Files(synthetic::FallingDrops(options), ingest::Format::kPly)) {
      files.push_back({file.name, store::AsString(file.bytes)});
    }
    Operation operation;
    const grpc::Status status = Upload(id, files, "", operation);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return operation;
  }

  int num_iterations_ = 120;

 private:
  store::Catalog* catalog() {
    if (!catalog_) catalog_ = OpenCatalog();
    return catalog_.get();
  }

  std::unique_ptr<store::Catalog> catalog_;
  double node_spacing_edges_ = 2.0;
};

TEST_F(CheckpointTest, AnotherWorkerGoesOnWhereAKilledOneWas) {
  TakeLonger();
  Process server = StartServer();
  const std::string expected = RegisterUndisturbed({"b"});
  const Operation registration = Submit({"b"});
  Process killed = StartWorker(Often());
  const JobRecord running = AwaitJob(registration, [](const JobRecord& job) {
    return !job.checkpoint_blob().empty() && job.progress().iteration() > 4;
  });
  EXPECT_EQ(killed.Kill(), -SIGKILL);
  // The progress may tell of an earlier one: it comes with the heartbeat.
  const absl::StatusOr<int> checkpointed =
      HasDataDirectory() ? CheckpointedIteration(registration) : 0;
  ASSERT_TRUE(checkpointed.ok()) << checkpointed.status();

  Process other = StartWorker(Often());
  const JobRecord resumed = AwaitJob(registration, IsResumed);
  EXPECT_NE(resumed.worker(), running.worker());
  EXPECT_EQ(resumed.attempts(), 1) << "one that leaves a checkpoint does not count";
  EXPECT_EQ(resumed.failed_attempts_size(), 1);
  EXPECT_GE(resumed.progress().resumed_iteration(), kEvery);
  if (HasDataDirectory()) {
    EXPECT_EQ(resumed.progress().resumed_iteration(), *checkpointed);
  }
  ExpectSuccess(AwaitDone(registration.name()));
  EXPECT_EQ(FamilyBlob(), expected);
  EXPECT_EQ(JobsOf(registration)[0].checkpoint_blob(), "");
}

// Where one animation has a drop more, no pairing of features gives a good registration, and
// another one is tried. More workers die in that one than a job has attempts.
TEST_F(CheckpointTest, WorkersThatAreKilledWhileAnotherPairingIsTriedUseUpNoAttempt) {
  num_iterations_ = 40;
  Process server = StartServer();
  {
    Process worker = StartWorker();
    ExpectSuccess(AwaitDone(ImportDrops("a", {0.5}).name()));
    ExpectSuccess(AwaitDone(ImportDrops("b", {0.6, -0.6}).name()));
    ExpectSuccess(AwaitDone(Submit({"b"}).name()));
  }
  const std::string expected = FamilyBlob();
  const Operation registration = Submit({"b"});
  {
    Process first = StartWorker(Often());
    AwaitJob(registration, [](const JobRecord& job) {
      return !job.checkpoint_blob().empty() && job.progress().stage() == "projection";
    });
    EXPECT_EQ(first.Kill(), -SIGKILL);
  }
  for (int n = 0; n < 4; ++n) {
    const JobRecord left = JobsOf(registration)[0];
    Process killed = StartWorker(Often());
    const JobRecord at_work = AwaitJob(registration, [&](const JobRecord& job) {
      const int resumed = job.progress().resumed_iteration() % num_iterations_;
      return job.worker() != left.worker() && job.progress().iteration() < num_iterations_ &&
             (job.checkpoint_blob() != left.checkpoint_blob() ||
              job.progress().iteration() > resumed + 5 * kEvery);
    });
    EXPECT_EQ(killed.Kill(), -SIGKILL);
    EXPECT_EQ(at_work.attempts(), 1);
  }
  Process worker = StartWorker();
  ExpectSuccess(AwaitDone(registration.name()));
  EXPECT_EQ(FamilyBlob(), expected);
}

// The first worker leaves a checkpoint; the second dies at the point while it makes another one.
TEST_F(CheckpointTest, AKillAtAnyPointCostsNoMoreThanTheWorkSinceTheLastCheckpoint) {
  Process server = StartServer();
  const std::string expected = RegisterUndisturbed({"b"});
  for (const std::string point : {"checkpoint.before_write", "checkpoint.after_write",
                                  "checkpoint.before_commit", "checkpoint.after_commit"}) {
    SCOPED_TRACE(point);
    const Operation registration = Submit({"b"});
    Process first = StartWorker(Often("checkpoint.after_commit"));
    EXPECT_EQ(first.Wait(), -SIGKILL);
    const std::string before = JobsOf(registration)[0].checkpoint_blob();
    EXPECT_NE(before, "");

    Process second = StartWorker(Often(point));
    EXPECT_EQ(second.Wait(), -SIGKILL);
    const JobRecord left = JobsOf(registration)[0];  // with the second one's progress
    EXPECT_EQ(left.checkpoint_blob() != before, point == "checkpoint.after_commit");

    Process third = StartWorker();  // makes none in so short a time
    const JobRecord resumed = AwaitJob(registration, [&](const JobRecord& job) {
      return job.worker() != left.worker() && IsResumed(job);
    });
    const int checkpointed = point == "checkpoint.after_commit" ? 2 * kEvery : kEvery;
    EXPECT_GE(resumed.progress().resumed_iteration(), checkpointed);
    ExpectSuccess(AwaitDone(registration.name()));
    EXPECT_EQ(FamilyBlob(), expected);
  }
}

TEST_F(CheckpointTest, EachTargetOfAFamilyGoesOnByItself) {
  Process server = StartServer();
  const std::vector<std::string> targets = {"b", "c", "d"};
  const std::string expected = RegisterUndisturbed(targets);
  const Operation registration = Submit(targets);
  for (int k = 0; k < 2; ++k) {
    Process killed = StartWorker(Often("checkpoint.after_commit"));
    EXPECT_EQ(killed.Wait(), -SIGKILL);
  }
  // Whose lease has ended is taken first, so that may be one child twice.
  const std::vector<JobRecord> left = JobsOf(registration);
  const auto has_checkpoint = [](const JobRecord& job) { return !job.checkpoint_blob().empty(); };
  EXPECT_GE(std::count_if(left.begin(), left.end(), has_checkpoint), 1);
  Process worker = StartWorker();
  AwaitJob(registration, IsResumed);
  ExpectSuccess(AwaitDone(registration.name()));
  EXPECT_EQ(FamilyBlob(), expected);
}

// Without SIGTERM there would be none: by default they are 10 s apart.
TEST_F(CheckpointTest, AWorkerThatIsStoppedLeavesOneBehind) {
  TakeLonger();
  Process server = StartServer();
  const std::string expected = RegisterUndisturbed({"b"});
  const Operation registration = Submit({"b"});
  JobRecord job;
  // A worker whose store takes longer than a second leaves none.
  for (int k = 0; k < 5 && job.checkpoint_blob().empty(); ++k) {
    Process stopped = StartWorker();
    AwaitJob(registration, [](const JobRecord& now) {
      return now.state() == JobRecord::RUNNING && now.progress().iteration() > 4;
    });
    stopped.Signal(SIGTERM);
    EXPECT_EQ(stopped.Wait(), 0);
    job = JobsOf(registration)[0];
    EXPECT_EQ(job.state(), JobRecord::QUEUED);
    EXPECT_EQ(job.attempts(), 0);
  }
  EXPECT_NE(job.checkpoint_blob(), "");

  Process other = StartWorker();
  EXPECT_GE(AwaitJob(registration, IsResumed).progress().resumed_iteration(), 5);
  ExpectSuccess(AwaitDone(registration.name()));
  EXPECT_EQ(FamilyBlob(), expected);
}

}  // namespace
}  // namespace liquidblend::e2e

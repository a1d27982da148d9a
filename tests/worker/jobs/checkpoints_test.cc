#include "worker/jobs/checkpoints.h"

#include <algorithm>
#include <filesystem>
#include <thread>
#include <variant>

#include "absl/algorithm/container.h"
#include "absl/synchronization/notification.h"
#include "core/base/log.h"
#include "core/store/blobs/mapped_file.h"
#include "tests/synthetic/implicit.h"
#include "tests/worker/jobs/jobs_testing.h"
#include "worker/jobs/checkpoint_file.h"

namespace liquidblend::jobs {
namespace {

using registration::CompetitionState;
using registration::IterationState;
using registration::RegistrationState;
using registration::SharpenState;
using store::Fails;
using store::Succeeds;
using store::pb::JobRecord;
using testing::HasSubstr;
using Code = absl::StatusCode;

constexpr int kNumIterations = 16;

IterationState After(int iteration) {
  IterationState state;
  state.last.iteration = iteration;
  state.last.num_iterations = kNumIterations;
  return state;
}

class CheckpointsTest : public JobsTest {
 protected:
  CheckpointsTest() {
    SubmitBall("still", 0.0);
    SubmitBall("slow", 1.0);
    EXPECT_THAT(Work(), Succeeds());
    job_ = SubmitRegistration("balls", "still", {"slow"});
    num_blobs_ = NumBlobs();
  }

  store::Lease Take(absl::Duration duration = absl::Seconds(30)) {
    auto lease = catalog_->LeaseJob("test", duration);
    EXPECT_TRUE(lease.ok() && lease->has_value());
    return **lease;
  }

  static CheckpointOptions AtOnce(int iterations = 1) {
    CheckpointOptions options;
    options.iterations = iterations;
    options.interval = absl::ZeroDuration();
    return options;
  }

  size_t NumBlobs() { return blobs_.List()->size(); }
  std::string Recorded() { return Job(job_).checkpoint_blob(); }

  // Of the checkpoint that the job's record names.
  int RecordedIteration() {
    const std::string id = Recorded();
    if (id.empty()) return 0;
    const auto blob = blobs_.Open(id);
    if (!blob.ok()) return 0;  // replaced meanwhile
    const auto read = ReadCheckpoint(**blob, "checkpoint");
    EXPECT_THAT(read, Succeeds());
    return std::get<IterationState>(read->state).last.iteration;
  }

  // A worker saves one and is lost.
  void LeaveCheckpoint(int iteration) {
    Checkpoints checkpoints(*catalog_, blobs_, Take(absl::Seconds(1)), AtOnce());
    ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
    checkpoints.Offer(After(iteration));
    Await([&] { return RecordedIteration() == iteration; });
    clock_ms_ += 1000;
  }

  // Whether the next worker goes on, and where.
  int ResumedIteration(const std::string& fingerprint) {
    Checkpoints next(*catalog_, blobs_, Take(), AtOnce());
    const auto state = next.Begin(fingerprint);
    EXPECT_THAT(state, Succeeds());
    return state->has_value() ? std::get<IterationState>(**state).last.iteration : 0;
  }

  std::string job_;
  size_t num_blobs_ = 0;  // without checkpoints
};

TEST_F(CheckpointsTest, OneEverySoManyIterationsReplacesTheOneBefore) {
  Checkpoints checkpoints(*catalog_, blobs_, Take(), AtOnce(2));
  const auto begun = checkpoints.Begin("print");
  ASSERT_THAT(begun, Succeeds());
  EXPECT_FALSE(begun->has_value());
  checkpoints.Offer(After(1));
  EXPECT_EQ(Recorded(), "");
  checkpoints.Offer(After(2));
  Await([&] { return RecordedIteration() == 2; });
  const std::string first = Recorded();
  checkpoints.Offer(After(3));
  checkpoints.Offer(After(4));
  Await([&] { return RecordedIteration() == 4; });
  Await([&] { return NumBlobs() == num_blobs_ + 1; });
  EXPECT_THAT(blobs_.Open(first), Fails(Code::kNotFound, first));
  checkpoints.End(/*is_done=*/false);
  EXPECT_EQ(NumBlobs(), num_blobs_ + 1);
}

TEST_F(CheckpointsTest, TheLastIterationAndFinerNodesNeedNotWaitForMore) {
  Checkpoints checkpoints(*catalog_, blobs_, Take(), AtOnce(100));
  ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
  checkpoints.Offer(After(kNumIterations));
  Await([&] { return RecordedIteration() == kNumIterations; });
  const std::string first = Recorded();
  checkpoints.Offer(SharpenState());
  Await([&] { return Recorded() != first; });
}

TEST_F(CheckpointsTest, OtherPairingsNeedNotWaitForMoreEither) {
  CheckpointOptions options = AtOnce(100);
  options.patience = absl::Minutes(1);
  Checkpoints checkpoints(*catalog_, blobs_, Take(), options);
  ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
  CompetitionState state;
  state.next = After(3);
  checkpoints.Offer(state);
  checkpoints.Flush();
  EXPECT_THAT(checkpoints.DescribeSaved(), HasSubstr("after iteration 3 of pairing 2;"));
  for (const int iteration : {kNumIterations, 0}) {
    const std::string before = Recorded();
    state.next = After(iteration);
    if (iteration == 0) state.next.reset();
    state.num_others += iteration == 0;
    checkpoints.Offer(state);
    Await([&] { return Recorded() != before; });
  }
  Await([&] { return checkpoints.DescribeSaved().find("after pairing 2;") != std::string::npos; });
}

TEST_F(CheckpointsTest, FlushSavesWhatIsNotDue) {
  CheckpointOptions options;
  options.interval = absl::Hours(1);
  options.patience = absl::Minutes(1);
  Checkpoints checkpoints(*catalog_, blobs_, Take(), options);
  checkpoints.Flush();  // nothing to save yet
  ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
  checkpoints.Flush();
  EXPECT_EQ(Recorded(), "");
  checkpoints.Offer(After(1));
  checkpoints.Flush();
  EXPECT_EQ(RecordedIteration(), 1);
}

TEST_F(CheckpointsTest, TellWhatTheySavedAndWhatIsLost) {
  CheckpointOptions options;
  options.interval = absl::Hours(1);
  options.patience = absl::Minutes(1);
  LeaveCheckpoint(3);
  Checkpoints checkpoints(*catalog_, blobs_, Take(), options);
  ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
  EXPECT_FALSE(checkpoints.HasNew()) << "the one that is there is another attempt's";
  EXPECT_THAT(checkpoints.DescribeSaved(),
              testing::StartsWith("without a new checkpoint; lost is the work of "));
  checkpoints.Offer(After(5));
  EXPECT_FALSE(checkpoints.HasNew());
  checkpoints.Flush();
  EXPECT_TRUE(checkpoints.HasNew());
  EXPECT_THAT(checkpoints.DescribeSaved(),
              testing::MatchesRegex("with a checkpoint after iteration 5; lost is the work of "
                                    ".* since then"));
}

// The time since the state was reached counts, not since it was written.
TEST_F(CheckpointsTest, CountTheWorkSinceAStateAsLost) {
  CheckpointOptions options;
  options.patience = absl::Minutes(1);
  Checkpoints checkpoints(*catalog_, blobs_, Take(), options);
  ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
  checkpoints.Offer(After(5));
  blobs_.on_create = [] {
    absl::SleepFor(absl::Milliseconds(200));
    return absl::OkStatus();
  };
  checkpoints.Flush();
  const std::string text = checkpoints.DescribeSaved();
  EXPECT_THAT(text, Not(HasSubstr("work of 0 since"))) << "rounded down to a tenth of a second";
}

TEST_F(CheckpointsTest, SlowStorageHoldsUpNeitherTheWorkNorAStop) {
  absl::Notification stored, begun;
  blobs_.on_create = [&] {
    if (!begun.HasBeenNotified()) begun.Notify();
    stored.WaitForNotification();
    return absl::OkStatus();
  };
  CheckpointOptions options = AtOnce();
  options.patience = absl::Milliseconds(1);
  Checkpoints checkpoints(*catalog_, blobs_, Take(), options);
  ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
  checkpoints.Offer(After(1));
  begun.WaitForNotification();
  checkpoints.Offer(After(2));
  checkpoints.Offer(After(3));
  checkpoints.Flush();
  EXPECT_EQ(Recorded(), "");
  stored.Notify();
  Await([&] { return RecordedIteration() == 3; });
}

TEST_F(CheckpointsTest, WhatCannotBeWrittenIsNoErrorAndTriedAgain) {
  std::atomic<int> num_tries = 0;
  blobs_.on_create = [&] {
    return ++num_tries == 1 ? absl::ResourceExhaustedError("disk full") : absl::OkStatus();
  };
  Checkpoints checkpoints(*catalog_, blobs_, Take(), AtOnce());
  ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
  checkpoints.Offer(After(1));
  Await([&] { return num_tries == 1; });
  EXPECT_EQ(Recorded(), "");
  checkpoints.Offer(After(2));
  Await([&] { return RecordedIteration() == 2; });
}

TEST_F(CheckpointsTest, MemoryThatRunsOutIsNoErrorEither) {
  std::atomic<int> num_tries = 0;
  blobs_.on_create = [&]() -> absl::Status {
    if (++num_tries == 1) throw std::bad_alloc();
    return absl::OkStatus();
  };
  Checkpoints checkpoints(*catalog_, blobs_, Take(), AtOnce());
  ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
  checkpoints.Offer(After(1));
  Await([&] { return num_tries == 1; });
  checkpoints.Offer(After(2));
  Await([&] { return RecordedIteration() == 2; });
}

TEST_F(CheckpointsTest, AWorkerThatLostItsJobLeavesTheOthersCheckpoint) {
  Checkpoints lost(*catalog_, blobs_, Take(absl::Seconds(1)), AtOnce());
  ASSERT_THAT(lost.Begin("print"), Succeeds());
  lost.Offer(After(4));
  Await([&] { return RecordedIteration() == 4; });
  clock_ms_ += 1000;
  Checkpoints current(*catalog_, blobs_, Take(), AtOnce());
  const auto resumed = current.Begin("print");
  ASSERT_THAT(resumed, Succeeds());
  ASSERT_TRUE(resumed->has_value());
  EXPECT_EQ(std::get<IterationState>(**resumed).last.iteration, 4);
  const std::string shared = Recorded();
  lost.Offer(After(5));
  lost.Flush();
  lost.End(/*is_done=*/false);
  EXPECT_EQ(Recorded(), shared);
  EXPECT_EQ(NumBlobs(), num_blobs_ + 1) << "the refused one is gone";
  current.Offer(After(6));
  Await([&] { return RecordedIteration() == 6; });
  Await([&] { return NumBlobs() == num_blobs_ + 1; });
}

TEST_F(CheckpointsTest, OfAJobThatIsDoneNoneIsLeft) {
  LeaveCheckpoint(4);
  const store::Lease lease = Take();
  Checkpoints checkpoints(*catalog_, blobs_, lease, AtOnce());
  ASSERT_THAT(checkpoints.Begin("print"), Succeeds());
  store::pb::FamilyRecord family;
  family.set_id("balls");
  ASSERT_THAT(catalog_->PublishFamily(lease.lease_id, family), Succeeds());
  checkpoints.End(/*is_done=*/true);
  EXPECT_EQ(NumBlobs(), num_blobs_);
}

TEST_F(CheckpointsTest, OneOfAnythingElseIsNotGoneOnFrom) {
  LeaveCheckpoint(4);
  EXPECT_EQ(ResumedIteration("another print"), 0);
  clock_ms_ += 30'000;
  EXPECT_EQ(ResumedIteration("print"), 4) << "that one was left as it was";
}

TEST_F(CheckpointsTest, ADamagedOneIsNotGoneOnFrom) {
  LeaveCheckpoint(4);
  const std::string path = store::LocalBlobPath(folder_.path(), Recorded());
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  std::filesystem::resize_file(path, 100);
  EXPECT_EQ(ResumedIteration("print"), 0);
}

TEST_F(CheckpointsTest, OneThatCannotBeReadAnyMoreIsNotGoneOnFrom) {
  store::SurviveUnreadablePages();
  LeaveCheckpoint(4);
  blobs_.after_open = [&](const store::BlobId& id) {
    std::filesystem::resize_file(store::LocalBlobPath(folder_.path(), id), 0);
  };
  base::StartLog("worker", base::LogLevel::kInfo, base::LogFormat::kJson);
  testing::internal::CaptureStderr();
  EXPECT_EQ(ResumedIteration("print"), 0);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("the disk may be failing"));
}

TEST_F(CheckpointsTest, OneThatIsGoneIsNotGoneOnFrom) {
  LeaveCheckpoint(4);
  ASSERT_THAT(blobs_.Delete(Recorded()), Succeeds());
  EXPECT_EQ(ResumedIteration("print"), 0);
}

TEST_F(CheckpointsTest, WhatIsNoCheckpointIsNotGoneOnFrom) {
  const std::string other = *store::PutBlob(blobs_, store::AsBytes("an upload"));
  ASSERT_THAT(catalog_->SaveCheckpoint(Take(absl::Seconds(1)).lease_id, other), Succeeds());
  clock_ms_ += 1000;
  EXPECT_EQ(ResumedIteration("print"), 0);
}

TEST_F(CheckpointsTest, StorageThatIsAwayForAWhileCostsNoCheckpoint) {
  LeaveCheckpoint(4);
  blobs_.on_open = [] { return absl::UnavailableError("S3 is away"); };
  {
    Checkpoints next(*catalog_, blobs_, Take(absl::Seconds(1)), AtOnce());
    EXPECT_THAT(next.Begin("print"), Fails(Code::kUnavailable, "S3 is away"));
  }
  blobs_.on_open = {};
  clock_ms_ += 1000;
  EXPECT_EQ(ResumedIteration("print"), 4);
}

TEST_F(CheckpointsTest, NoneAreMadeUnlessAskedForButOneIsGoneOnFrom) {
  LeaveCheckpoint(4);
  const std::string before = Recorded();
  Checkpoints next(*catalog_, blobs_, Take(), AtOnce(0));
  const auto state = next.Begin("print");
  ASSERT_THAT(state, Succeeds());
  EXPECT_TRUE(state->has_value());
  next.Offer(After(kNumIterations));
  next.Flush();
  next.End(/*is_done=*/false);
  EXPECT_EQ(Recorded(), before);
}

// ---- of whole jobs

class ResumedJobTest : public CheckpointsTest {
 protected:
  static constexpr int kManyIterations = 60;
  // Iteration up to which a worker is to be stopped: the work that is left takes long enough for a
  // report of the worker that goes on.
  static constexpr int kLatestStop = 3 * kManyIterations / 4;

  std::string SubmitLong(const std::vector<std::string>& targets) {
    return SubmitRegistration("long", "still", targets, [](auto& registration) {
      registration.mutable_options()->set_max_iterations(kManyIterations);
    });
  }

  // Works until the queue is empty or `is_enough` holds; then is asked to stop.
  void WorkUntil(const std::function<bool()>& is_enough, const CheckpointOptions& checkpoints) {
    StopSignal stop;
    JobLoopOptions options;
    options.idle_time = absl::ZeroDuration();
    options.lease.report_interval = absl::Milliseconds(2);
    options.checkpoints = checkpoints;
    std::thread worker([&] {
      EXPECT_THAT(RunJobs(*catalog_, blobs_, parallel::Arena(1), stop, options), Succeeds());
    });
    Await(is_enough);
    stop.Request();
    worker.join();
  }

  // Options of a worker that saves a checkpoint only when it is asked to stop.
  static CheckpointOptions OnlyAtStop() {
    CheckpointOptions options;
    options.interval = absl::Hours(1);
    options.patience = absl::Seconds(10);
    return options;
  }

  // Submits a registration and stops its worker in mid-work, once `is_enough`. Returns the job.
  // Its iterations can be done before its worker is asked to stop; then another one is submitted.
  std::string StopMidway(const std::vector<std::string>& targets,
                         const std::function<bool(const std::string& job)>& is_enough) {
    for (int n = 0; n < 20; ++n) {
      const std::string job = SubmitLong(targets);
      WorkUntil([&] { return IsIterated(job) || is_enough(job); }, OnlyAtStop());
      if (!IsIterated(job)) return job;
      EXPECT_THAT(Work(), Succeeds());
    }
    ADD_FAILURE() << "each was done before its worker was stopped";
    return "";
  }

  // Whether all iterations are done.
  bool IsIterated(const std::string& job) {
    const auto is_done = [](const JobRecord& of) { return of.state() == JobRecord::SUCCEEDED; };
    const std::vector<JobRecord> children = *catalog_->ListChildren(job);
    return is_done(Job(job)) || (!children.empty() && absl::c_all_of(children, is_done));
  }

  // Whether a checkpoint can be left, and work after it.
  static bool IsMidway(const JobRecord& job) {
    return job.progress().iteration() >= 3 && job.progress().iteration() <= kLatestStop;
  }

  std::string StopMidway() {
    return StopMidway({"slow"}, [this](const std::string& job) { return IsMidway(Job(job)); });
  }

  // Iteration of the next pairing that a job's checkpoint is of; 0 if it is of no such iteration.
  int IterationOfNextPairing(const std::string& job) {
    const auto blob = blobs_.Open(Job(job).checkpoint_blob());
    if (!blob.ok()) return 0;
    const auto left = ReadCheckpoint(**blob, "checkpoint");
    EXPECT_THAT(left, Succeeds());
    const auto* const state = std::get_if<CompetitionState>(&left->state);
    return state != nullptr && state->next ? state->next->last.iteration : 0;
  }

  // Stops a worker once the first pairing is iterated, and two in the next pairing. Returns the
  // iteration in that pairing which the last one has left behind; 0 if one was stopped too late.
  int StopInNextPairing(const std::string& job) {
    int most = 0;
    WorkUntil(
        [&] {
          const store::pb::JobProgress progress = Job(job).progress();
          most = std::max(most, progress.iteration());
          return IsIterated(job) || progress.stage() == "projection" || progress.iteration() < most;
        },
        OnlyAtStop());
    int iteration = IterationOfNextPairing(job);  // if it was stopped late
    for (int n = 0; n < 2; ++n) {
      WorkUntil(
          [&] {
            const int now = Job(job).progress().iteration();
            return IsIterated(job) || (now >= iteration + 2 && now <= kLatestStop);
          },
          OnlyAtStop());
      if (IsIterated(job)) return 0;
      EXPECT_EQ(Job(job).state(), JobRecord::QUEUED);
      EXPECT_EQ(Job(job).handed_back_in_vain(), 0);
      const int next = IterationOfNextPairing(job);
      if (next == 0) return 0;
      EXPECT_GE(next, iteration + 2);
      iteration = next;
    }
    return iteration;
  }

  std::string LongBlob() { return catalog_->GetFamily("long")->blob(); }
};

TEST_F(ResumedJobTest, AStoppedWorkersRegistrationGoesOnToTheSameBytes) {
  ASSERT_THAT(Work(), Succeeds());  // the fixture's own
  SubmitLong({"slow"});
  ASSERT_THAT(Work(), Succeeds());
  const std::string expected = LongBlob();
  const size_t num_blobs = NumBlobs();

  const std::string job = StopMidway();
  const JobRecord stopped = Job(job);
  ASSERT_EQ(stopped.state(), JobRecord::QUEUED);
  EXPECT_EQ(stopped.attempts(), 0);
  ASSERT_NE(stopped.checkpoint_blob(), "");
  EXPECT_EQ(NumBlobs(), num_blobs + 1);

  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED);
  EXPECT_GE(Job(job).progress().resumed_iteration(), 3);
  EXPECT_EQ(LongBlob(), expected);
  EXPECT_EQ(NumBlobs(), num_blobs) << "the checkpoint is gone, and the family's file is the same";
}

TEST_F(ResumedJobTest, ChildrenGoOnByThemselves) {
  ASSERT_THAT(Work(), Succeeds());
  SubmitBall("fast", 3.0);
  ASSERT_THAT(Work(), Succeeds());
  SubmitLong({"slow", "fast"});
  ASSERT_THAT(Work(), Succeeds());
  const std::string expected = LongBlob();
  const std::string job = StopMidway({"slow", "fast"}, [this](const std::string& parent) {
    const std::vector<JobRecord> children = *catalog_->ListChildren(parent);
    return children.size() == 2 && IsMidway(children[1]);
  });
  const std::vector<JobRecord> stopped = *catalog_->ListChildren(job);
  ASSERT_EQ(stopped.size(), 2);
  EXPECT_EQ(stopped[0].state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(stopped[0].checkpoint_blob(), "");
  ASSERT_NE(stopped[1].checkpoint_blob(), "");
  int resumed = 0;
  blobs_.on_open = [&] {
    const std::vector<JobRecord> children = *catalog_->ListChildren(job);
    for (const JobRecord& each : children) {
      resumed = std::max(resumed, each.progress().resumed_iteration());
    }
    return absl::OkStatus();
  };
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_GE(resumed, 3);
  EXPECT_EQ(LongBlob(), expected);
}

// Where one animation has a drop more, no pairing gives a good registration, so that all are tried.
TEST_F(ResumedJobTest, AWorkerThatIsStoppedWhileOtherPairingsAreTriedLeavesOneBehind) {
  ASSERT_THAT(Work(), Succeeds());
  const auto import = [&](const std::string& id, const std::vector<double>& drops_x_m) {
    synthetic::FallingDropsOptions options;
    for (const double x : drops_x_m) options.drops.push_back({.centre_m = {x, 0, 0.8}});
    options.pool_half_width_m = {1.2, 0.4};
    options.num_frames = 4;
    SubmitImport(id, ingest::Files(synthetic::FallingDrops(options), ingest::Format::kPly));
  };
  import("one drop", {0.5});
  import("two drops", {0.6, -0.6});
  ASSERT_THAT(Work(), Succeeds());
  const auto submit = [&] {
    return SubmitRegistration("long", "one drop", {"two drops"}, [](auto& registration) {
      registration.mutable_options()->set_max_iterations(kManyIterations);
      registration.mutable_options()->set_sample_share(0.1);
    });
  };
  submit();
  ASSERT_THAT(Work(), Succeeds());
  const std::string expected = LongBlob();
  ASSERT_EQ(catalog_->GetFamily("long")->manifest().reports(0).hypotheses_size(), 2);

  std::string job;
  int iteration = 0;
  for (int n = 0; n < 20 && iteration == 0; ++n) {
    ASSERT_THAT(Work(), Succeeds());
    job = submit();
    iteration = StopInNextPairing(job);
  }
  ASSERT_GT(iteration, 0) << "each was done before its worker was stopped";
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).progress().resumed_iteration(), iteration);
  EXPECT_EQ(LongBlob(), expected);
}

TEST_F(ResumedJobTest, ACheckpointOfOtherInputsIsNotGoneOnFrom) {
  ASSERT_THAT(Work(), Succeeds());
  const std::string job = StopMidway();
  const std::string checkpoint = Job(job).checkpoint_blob();
  ASSERT_NE(checkpoint, "");
  const std::shared_ptr<const store::Blob> bytes = *blobs_.Open(checkpoint);
  ASSERT_THAT(catalog_->RequestCancel(job), Succeeds());

  const std::string other = SubmitLong({"slow"});
  store::Lease lease = Take();
  ASSERT_THAT(catalog_->SaveCheckpoint(lease.lease_id, checkpoint), Succeeds());
  ASSERT_THAT(catalog_->ReleaseJob(lease.lease_id), Succeeds());
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_GE(Job(other).progress().resumed_iteration(), 3) << "the same inputs, to the byte";
  ASSERT_EQ(*store::PutBlob(blobs_, bytes->bytes()), checkpoint) << "it was used up";

  const std::string changed = SubmitRegistration("long", "still", {"slow"}, [](auto& registration) {
    registration.mutable_options()->set_max_iterations(kManyIterations);
    registration.mutable_options()->set_seed(7);
  });
  lease = Take();
  ASSERT_THAT(catalog_->SaveCheckpoint(lease.lease_id, checkpoint), Succeeds());
  ASSERT_THAT(catalog_->ReleaseJob(lease.lease_id), Succeeds());
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(changed).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(Job(changed).progress().resumed_iteration(), 0);
}

TEST_F(ResumedJobTest, AStateThatDoesNotFitIsNotGoneOnFrom) {
  ASSERT_THAT(Work(), Succeeds());
  const std::string job = StopMidway();
  auto checkpoint = ReadCheckpoint(**blobs_.Open(Job(job).checkpoint_blob()), "checkpoint");
  ASSERT_THAT(checkpoint, Succeeds());
  std::get<IterationState>(checkpoint->state).maps.pop_back();
  const auto out = *blobs_.Create();
  ASSERT_THAT(WriteCheckpoint(checkpoint->label, checkpoint->state, *out), Succeeds());
  const store::Lease lease = Take();
  ASSERT_THAT(catalog_->SaveCheckpoint(lease.lease_id, *out->Commit()), Succeeds());
  ASSERT_THAT(catalog_->ReleaseJob(lease.lease_id), Succeeds());
  ASSERT_THAT(Work(), Succeeds());
  EXPECT_EQ(Job(job).state(), JobRecord::SUCCEEDED) << Job(job).error().message();
  EXPECT_EQ(Job(job).progress().resumed_iteration(), 0);
}

}  // namespace
}  // namespace liquidblend::jobs

#include "worker/jobs/run_jobs.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"
#include "core/store/blobs/upload_files.h"
#include "worker/jobs/attempt/run_guarded.h"
#include "worker/jobs/attempt/traced_attempt.h"
#include "worker/jobs/job_context.h"
#include "worker/jobs/run_child.h"
#include "worker/jobs/run_import.h"
#include "worker/jobs/run_registration.h"

namespace liquidblend::jobs {
namespace {

constexpr absl::Duration kStopPoll = absl::Milliseconds(100);
constexpr absl::Duration kAfterError = absl::Milliseconds(500);  // of the queue, until the next try
constexpr double kReportJitter = 0.5;  // many workers may have failed at one time

// Whether another attempt, perhaps on another machine, may succeed.
bool IsWorthRetrying(const absl::Status& status) {
  return base::IsTransient(status) || absl::IsInternal(status);
}

// Whether an error of the queue ends the worker: the catalog is damaged, or its tables are of a
// newer program.
bool IsFinal(const absl::Status& status) {
  return absl::IsDataLoss(status) || absl::IsFailedPrecondition(status);
}

absl::Status RunStages(const store::pb::JobRecord& job, JobContext& context) {
  if (job.has_import_animation()) return RunImport(job.import_animation(), context);
  if (job.has_register_family()) return RunRegistration(job.register_family(), context);
  if (job.has_register_target()) return RunChild(job, context);
  return absl::InvalidArgumentError("the job has no known task; it may be from a newer program");
}

// Outcome of the stages. If the job was not to go on, LeaseKeeper's reason replaces the stages'
// error.
absl::Status Outcome(const absl::Status& stages, const LeaseKeeper& keeper) {
  const absl::Status kept = keeper.Check();
  return stages.ok() || kept.ok() ? stages : kept;
}

store::pb::WorkerRecord RecordOf(const JobLoopOptions& options) {
  store::pb::WorkerRecord worker;
  worker.set_name(options.worker);
  worker.set_memory_bytes(options.memory_bytes);
  return worker;
}

// How a worker's attempts at jobs have ended.
struct Tally {
  int64_t num_done = 0;
  int64_t num_failed = 0;  // for good, or to be tried again
  int64_t num_handed_back = 0;

  int64_t num_attempts() const { return num_done + num_failed + num_handed_back; }
  std::string Describe() const {
    return absl::StrCat(num_done, num_done == 1 ? " job" : " jobs", " done, ", num_failed,
                        " failed, ", num_handed_back, " handed back");
  }
};

// Threads: one.
class JobLoop {
 public:
  // Requires: options.Validate().ok(); all outlive this.
  JobLoop(store::Catalog& catalog, store::BlobStore& blobs, const parallel::Arena& arena,
          const StopSignal& stop, const JobLoopOptions& options)
      : catalog_(catalog),
        blobs_(blobs),
        arena_(arena),
        stop_(stop),
        options_(options),
        access_(catalog, blobs, stop, RecordOf(options), options.access) {}

  // See RunJobs().
  absl::StatusOr<LoopEnd> Run();

 private:
  // The next job, or nothing. A failure to ask for it is waited out.
  absl::StatusOr<std::optional<store::Lease>> NextLease();
  void Await(const absl::Status& refusal);

  // Run a job to its end; RunGuarded() also what its threads throw.
  void RunGuarded(const store::Lease& lease);
  void RunLeased(const store::Lease& lease);
  JobMemory MemoryOf(const store::pb::JobRecord& job) const;
  std::string BeforeRelease(const store::Lease& lease, Checkpoints& checkpoints) const;
  void Settle(const store::Lease& lease, const absl::Status& outcome, bool is_released);
  // See RecordFailure() below.
  struct Recorded {
    bool is_taken = false;     // by the catalog
    bool was_refused = false;  // until access was granted again
  };
  Recorded RecordFailure(const store::Lease& lease, const absl::Status& outcome);
  bool AwaitNextTry(int num_failures);
  bool HasFailed(const store::pb::JobRecord& job);

  // Waits for a job. Returns whether the worker stays; not if it has waited for options_.idle_time.
  bool Idle();
  absl::Status AwaitJob(absl::Duration longest);
  std::string DescribeQueue();

  store::Catalog& catalog_;
  store::BlobStore& blobs_;
  const parallel::Arena& arena_;
  const StopSignal& stop_;
  const JobLoopOptions& options_;
  Access access_;
  Tally tally_;
  std::optional<base::SteadyClock::time_point> idle_since_;
};

absl::StatusOr<LoopEnd> JobLoop::Run() {
  if (!options_.refusal.ok()) Await(options_.refusal);
  while (!stop_.is_requested()) {
    if (options_.max_jobs > 0 && tally_.num_attempts() >= options_.max_jobs) {
      base::LogInfo(absl::StrCat("as many jobs as it may take: ", tally_.Describe()));
      return LoopEnd::kMaxJobs;
    }
    const absl::StatusOr<std::optional<store::Lease>> lease = NextLease();
    if (IsFinal(lease.status())) return lease.status();
    if (lease.ok() && lease->has_value()) RunGuarded(**lease);
    if (!lease.ok() || lease->has_value()) {
      idle_since_.reset();
      continue;
    }
    if (!Idle()) {
      base::LogInfo(absl::StrCat("drained: ", tally_.Describe(), DescribeQueue()));
      return LoopEnd::kDrained;
    }
  }
  base::LogInfo(absl::StrCat("stopped: ", tally_.Describe()));
  return LoopEnd::kStopped;
}

absl::StatusOr<std::optional<store::Lease>> JobLoop::NextLease() {
  absl::StatusOr<std::optional<store::Lease>> lease;
  const absl::Status status = Guarded("worker", [&] {
    lease = catalog_.LeaseJob(options_.worker, options_.lease.duration, options_.memory_bytes);
    return lease.status();
  });
  if (status.ok()) return lease;
  if (IsRefusal(status)) {
    Await(status);
  } else if (!IsFinal(status)) {
    base::LogWarning(absl::StrCat("queue: ", status.ToString()));
    stop_.WaitFor(std::min(options_.poll, kAfterError));
  }
  return status;
}

void JobLoop::Await(const absl::Status& refusal) {
  Guarded("worker", [&] {
    access_.AwaitAfter(refusal);
    return absl::OkStatus();
  }).IgnoreError();  // the next lease tells what the matter is
}

// Exceptions outside of the stages, where threads start and end, are trouble of the worker.
void JobLoop::RunGuarded(const store::Lease& lease) {
  const absl::Status trouble = Guarded("worker", [&] {
    RunLeased(lease);
    return absl::OkStatus();
  });
  if (trouble.ok()) return;
  Guarded("worker", [&] {
    Settle(lease, absl::UnavailableError(trouble.message()), /*is_released=*/false);
    return absl::OkStatus();
  }).IgnoreError();  // the lease lapses
}

void JobLoop::RunLeased(const store::Lease& lease) {
  base::Log(base::LogLevel::kInfo,
            absl::StrCat("job ", lease.job.id(), ": attempt ", lease.job.attempts()),
            TraceFields(lease.job));
  TracedAttempt trace(options_.tracer, lease.job, options_.worker);
  absl::Status outcome;
  bool is_released = false;
  {
    Checkpoints checkpoints(catalog_, blobs_, lease, options_.checkpoints);
    LeaseKeeper keeper(catalog_, lease, stop_, options_.lease,
                       [&] { return BeforeRelease(lease, checkpoints); });
    JobContext context(catalog_, blobs_, arena_, keeper, checkpoints, trace);
    const absl::Status stages = RunWithinMemory(
        MemoryOf(lease.job), [&] { return context.stage(); },
        [&] { return RunStages(lease.job, context); });
    outcome = Outcome(stages, keeper);
    checkpoints.End(/*is_done=*/outcome.ok());
    is_released = keeper.is_released();
  }
  trace.End(outcome);
  Settle(lease, outcome, is_released);
}

JobMemory JobLoop::MemoryOf(const store::pb::JobRecord& job) const {
  const auto& failed = job.failed_attempts();
  const bool was_close = !failed.empty() && WasCloseToLimit(failed.rbegin()->error().message());
  return {job.memory_bytes(), options_.memory_bytes, was_close};
}

std::string JobLoop::BeforeRelease(const store::Lease& lease, Checkpoints& checkpoints) const {
  checkpoints.Flush();
  const int num_in_vain = lease.job.handed_back_in_vain() + 1;
  if (num_in_vain > 1 && !checkpoints.HasNew()) {
    base::LogWarning(absl::StrCat("job ", lease.job.id(), ": handed back ", num_in_vain,
                                  " times in succession without a new checkpoint: its workers "
                                  "need more time (--max-time, the farm's time limit)"));
  }
  return checkpoints.DescribeSaved();
}

// Tells the catalog how the job ended. A published job has ended already; one that is lost, or has
// gone back to the queue, is no longer ours. A worker that is refused waits here.
void JobLoop::Settle(const store::Lease& lease, const absl::Status& outcome, bool is_released) {
  if (!is_released) {
    const std::string ended =
        outcome.ok() ? "done" : outcome.ToString(absl::StatusToStringMode::kWithNoExtraData);
    base::Log(outcome.ok() ? base::LogLevel::kInfo : base::LogLevel::kWarning,
              absl::StrCat("job ", lease.job.id(), ": ", ended), TraceFields(lease.job));
  }
  ++(outcome.ok() ? tally_.num_done : is_released ? tally_.num_handed_back : tally_.num_failed);
  const bool is_ours = !outcome.ok() && !absl::IsAborted(outcome) && !is_released;
  const Recorded recorded = is_ours ? RecordFailure(lease, outcome) : Recorded();
  if (recorded.is_taken && HasFailed(lease.job)) {
    store::DeleteUploadedFiles(lease.job.import_animation(), blobs_);  // they count for nobody now
  }
  if (recorded.was_refused) return;  // it has waited for access already
  if (!IsRefusal(outcome)) return access_.Granted();
  access_.AwaitAfter(outcome);
}

// Tells the catalog that the job failed, again and again while the catalog is away or refuses that:
// a job whose failure nobody reports counts as one that its worker was lost with. Gives up when the
// worker stops.
JobLoop::Recorded JobLoop::RecordFailure(const store::Lease& lease, const absl::Status& outcome) {
  Recorded recorded;
  for (int num_failures = 1;; ++num_failures) {
    const absl::Status status = catalog_.FailJob(lease.lease_id, outcome, IsWorthRetrying(outcome));
    // Not ours any more: the answer to an earlier call may have been lost.
    recorded.is_taken = status.ok() || (absl::IsAborted(status) && num_failures > 1);
    if (status.ok()) return recorded;
    base::LogWarning(
        absl::StrCat("job ", lease.job.id(), ": cannot record its failure: ", status.ToString()));
    if (!base::IsTransient(status) || stop_.is_requested()) return recorded;
    if (IsRefusal(status)) {
      recorded.was_refused = true;
      access_.AwaitAfter(status);
    } else if (!AwaitNextTry(num_failures)) {
      return recorded;
    }
  }
}

// Waits for a while that grows with the number of failures, but less than a lease: so long the job
// is left to its worker once the catalog is back. Returns whether to go on.
bool JobLoop::AwaitNextTry(int num_failures) {
  const absl::Duration longest = std::min(options_.poll, options_.lease.duration / 3);
  const absl::Duration pause =
      base::ExponentialPause(num_failures, std::min(kAfterError, longest), longest);
  return !stop_.WaitFor(base::Jittered(pause, kReportJitter));
}

// Whether the job has ended without success: its last attempt is used up, or it was cancelled.
bool JobLoop::HasFailed(const store::pb::JobRecord& job) {
  const absl::StatusOr<store::pb::JobRecord> now = catalog_.GetJob(job.id());
  return now.ok() && (now->state() == store::pb::JobRecord::FAILED ||
                      now->state() == store::pb::JobRecord::CANCELLED);
}

bool JobLoop::Idle() {
  const base::SteadyClock::time_point now = base::SteadyClock::now();
  const absl::Duration left =
      options_.idle_time - absl::FromChrono(now - idle_since_.value_or(now));
  if (left <= absl::ZeroDuration()) return false;
  idle_since_ = idle_since_.value_or(now);
  const absl::Duration longest = std::min(left, options_.poll);
  const absl::Status awaited = Guarded("worker", [&] { return AwaitJob(longest); });
  // The next lease tells what the matter is.
  if (!awaited.ok()) stop_.WaitFor(std::min(longest, kAfterError));
  return true;
}

// Waits until there may be something to do, but not longer than that. Notices a request to stop
// within kStopPoll. Errors: the catalog's.
absl::Status JobLoop::AwaitJob(absl::Duration longest) {
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  while (!stop_.is_requested()) {
    const absl::Duration left = longest - base::Since(begin);
    if (left <= absl::ZeroDuration()) break;
    LB_ASSIGN_OR_RETURN(const bool has_job,
                        catalog_.WaitForJob(std::min(left, kStopPoll), options_.memory_bytes));
    if (has_job) break;
  }
  return absl::OkStatus();
}

// What a worker that has found nothing to do leaves to others; empty: nothing.
std::string JobLoop::DescribeQueue() {
  absl::StatusOr<store::JobCounts> counts;
  const absl::Status status = Guarded("worker", [&] {
    counts = catalog_.CountJobs();
    return counts.status();
  });
  if (!status.ok()) return "";
  const auto num = [&](store::pb::JobRecord::State state) {
    const auto found = counts->find(state);
    return found == counts->end() ? 0 : found->second;
  };
  std::string text;
  if (const int64_t num_running = num(store::pb::JobRecord::RUNNING); num_running > 0) {
    absl::StrAppend(&text, "; ", num_running, " running elsewhere");
  }
  if (const int64_t num_queued = num(store::pb::JobRecord::QUEUED); num_queued > 0) {
    absl::StrAppend(&text, "; ", num_queued, " queued that need more memory or are tried later");
  }
  return text;
}

}  // namespace

void RecordRefusal(store::Catalog& catalog, const JobLoopOptions& options,
                   const absl::Status& refusal) {
  store::pb::WorkerRecord worker = RecordOf(options);
  worker.set_refusal(RefusalOf(refusal));
  catalog.RecordWorker(worker).IgnoreError();
}

absl::Status JobLoopOptions::Validate() const {
  if (worker.empty()) return absl::InvalidArgumentError("worker must have a name");
  if (poll <= absl::ZeroDuration()) {
    return absl::InvalidArgumentError(
        absl::StrCat("poll is out of range: ", absl::FormatDuration(poll)));
  }
  if (idle_time < absl::ZeroDuration()) {
    return absl::InvalidArgumentError(
        absl::StrCat("idle_time is out of range: ", absl::FormatDuration(idle_time)));
  }
  if (max_jobs < 0) {
    return absl::InvalidArgumentError(absl::StrCat("max_jobs is out of range: ", max_jobs));
  }
  if (memory_bytes <= 0) {
    return absl::InvalidArgumentError(absl::StrCat("memory_bytes is out of range: ", memory_bytes));
  }
  LB_RETURN_IF_ERROR(lease.Validate());
  LB_RETURN_IF_ERROR(access.Validate());
  return checkpoints.Validate();
}

absl::StatusOr<LoopEnd> RunJobs(store::Catalog& catalog, store::BlobStore& blobs,
                                const parallel::Arena& arena, const StopSignal& stop,
                                const JobLoopOptions& options) {
  LB_RETURN_IF_ERROR(options.Validate());
  return JobLoop(catalog, blobs, arena, stop, options).Run();
}

}  // namespace liquidblend::jobs

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

// Whether another attempt, perhaps on another machine, may succeed.
bool IsWorthRetrying(const absl::Status& status) {
  return base::IsTransient(status) || absl::IsInternal(status);
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

// Tells the catalog that the job failed, and returns whether it took that.
absl::Status RecordFailure(store::Catalog& catalog, const store::Lease& lease,
                           const absl::Status& outcome) {
  const absl::Status recorded = catalog.FailJob(lease.lease_id, outcome, IsWorthRetrying(outcome));
  if (!recorded.ok()) {
    base::LogWarning(
        absl::StrCat("job ", lease.job.id(), ": cannot record its failure: ", recorded.ToString()));
  }
  return recorded;
}

// Whether the job has ended without success: its last attempt is used up, or it was cancelled.
bool HasFailed(store::Catalog& catalog, const store::pb::JobRecord& job) {
  const absl::StatusOr<store::pb::JobRecord> now = catalog.GetJob(job.id());
  return now.ok() && (now->state() == store::pb::JobRecord::FAILED ||
                      now->state() == store::pb::JobRecord::CANCELLED);
}

// Tells the catalog how the job ended. A published job has ended already; one that is lost, or has
// gone back to the queue, is no longer ours. A worker that is refused waits here; if the catalog
// itself refused to record the failure, it is recorded afterwards, so that no attempt is used up.
void Settle(store::Catalog& catalog, store::BlobStore& blobs, const store::Lease& lease,
            const absl::Status& outcome, bool is_released, Access& access) {
  const std::string ended =
      outcome.ok() ? "done" : outcome.ToString(absl::StatusToStringMode::kWithNoExtraData);
  base::Log(outcome.ok() ? base::LogLevel::kInfo : base::LogLevel::kWarning,
            absl::StrCat("job ", lease.job.id(), ": ", ended), TraceFields(lease.job));
  const bool is_ours = !outcome.ok() && !absl::IsAborted(outcome) && !is_released;
  const absl::Status recorded = is_ours ? RecordFailure(catalog, lease, outcome) : absl::OkStatus();
  if (is_ours && recorded.ok() && HasFailed(catalog, lease.job)) {
    store::DeleteUploadedFiles(lease.job.import_animation(), blobs);  // they count for nobody now
  }
  if (!IsRefusal(outcome) && !IsRefusal(recorded)) return access.Granted();
  access.AwaitAfter(IsRefusal(outcome) ? outcome : recorded);
  if (IsRefusal(recorded)) RecordFailure(catalog, lease, outcome).IgnoreError();
}

void RunJob(store::Catalog& catalog, store::BlobStore& blobs, const parallel::Arena& arena,
            const StopSignal& stop, const store::Lease& lease, const JobLoopOptions& options,
            Access& access) {
  base::Log(base::LogLevel::kInfo,
            absl::StrCat("job ", lease.job.id(), ": attempt ", lease.job.attempts()),
            TraceFields(lease.job));
  TracedAttempt trace(options.tracer, lease.job, options.worker);
  absl::Status outcome;
  bool is_released = false;
  {
    Checkpoints checkpoints(catalog, blobs, lease, options.checkpoints);
    LeaseKeeper keeper(catalog, lease, stop, options.lease, [&] { checkpoints.Flush(); });
    JobContext context(catalog, blobs, arena, keeper, checkpoints, trace);
    const absl::Status stages = RunWithinMemory(
        {lease.job.memory_bytes(), options.memory_bytes}, [&] { return context.stage(); },
        [&] { return RunStages(lease.job, context); });
    outcome = Outcome(stages, keeper);
    checkpoints.End(/*is_done=*/outcome.ok());
    is_released = absl::IsUnavailable(keeper.Check());
  }
  trace.End(outcome);
  Settle(catalog, blobs, lease, outcome, is_released, access);
}

// Exceptions outside of the stages, where threads start and end, are trouble of the worker.
void RunJobGuarded(store::Catalog& catalog, store::BlobStore& blobs, const parallel::Arena& arena,
                   const StopSignal& stop, const store::Lease& lease, const JobLoopOptions& options,
                   Access& access) {
  const absl::Status trouble = Guarded("worker", [&] {
    RunJob(catalog, blobs, arena, stop, lease, options, access);
    return absl::OkStatus();
  });
  if (trouble.ok()) return;
  Guarded("worker", [&] {
    Settle(catalog, blobs, lease, absl::UnavailableError(trouble.message()), /*is_released=*/false,
           access);
    return absl::OkStatus();
  }).IgnoreError();  // the lease lapses
}

absl::StatusOr<std::optional<store::Lease>> LeaseGuarded(store::Catalog& catalog,
                                                         const JobLoopOptions& options) {
  absl::StatusOr<std::optional<store::Lease>> lease;
  const absl::Status status = Guarded("worker", [&] {
    lease = catalog.LeaseJob(options.worker, options.lease.duration, options.memory_bytes);
    return lease.status();
  });
  if (!status.ok()) return status;
  return lease;
}

void AwaitGuarded(Access& access, const absl::Status& refusal) {
  Guarded("worker", [&] {
    access.AwaitAfter(refusal);
    return absl::OkStatus();
  }).IgnoreError();  // the next lease tells what the matter is
}

// Waits until there may be something to do, but not longer than options.poll. Notices a request to
// stop within kStopPoll.
void AwaitJob(store::Catalog& catalog, const StopSignal& stop, const JobLoopOptions& options) {
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  while (!stop.is_requested()) {
    const absl::Duration left = options.poll - base::Since(begin);
    if (left <= absl::ZeroDuration()) return;
    const absl::StatusOr<bool> has_job =
        catalog.WaitForJob(std::min(left, kStopPoll), options.memory_bytes);
    if (has_job.ok() && *has_job) return;
    if (!has_job.ok()) stop.WaitFor(left);  // the next lease tells what the matter is
  }
}

store::pb::WorkerRecord RecordOf(const JobLoopOptions& options) {
  store::pb::WorkerRecord worker;
  worker.set_name(options.worker);
  worker.set_memory_bytes(options.memory_bytes);
  return worker;
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
  if (memory_bytes <= 0) {
    return absl::InvalidArgumentError(absl::StrCat("memory_bytes is out of range: ", memory_bytes));
  }
  LB_RETURN_IF_ERROR(lease.Validate());
  LB_RETURN_IF_ERROR(access.Validate());
  return checkpoints.Validate();
}

absl::Status RunJobs(store::Catalog& catalog, store::BlobStore& blobs, const parallel::Arena& arena,
                     const StopSignal& stop, const JobLoopOptions& options) {
  LB_RETURN_IF_ERROR(options.Validate());
  Access access(catalog, blobs, stop, RecordOf(options), options.access);
  if (!options.refusal.ok()) AwaitGuarded(access, options.refusal);
  while (!stop.is_requested()) {
    absl::StatusOr<std::optional<store::Lease>> lease = LeaseGuarded(catalog, options);
    if (lease.ok() && lease->has_value()) {
      RunJobGuarded(catalog, blobs, arena, stop, **lease, options, access);
      continue;
    }
    if (absl::IsDataLoss(lease.status())) return lease.status();
    if (IsRefusal(lease.status())) {
      AwaitGuarded(access, lease.status());
      continue;
    }
    if (!lease.ok()) base::LogWarning(absl::StrCat("queue: ", lease.status().ToString()));
    if (!lease.ok()) {
      stop.WaitFor(options.poll);
      continue;
    }
    if (options.exit_when_idle) return absl::OkStatus();
    const absl::Status awaited = Guarded("worker", [&] {
      AwaitJob(catalog, stop, options);
      return absl::OkStatus();
    });
    if (!awaited.ok()) stop.WaitFor(options.poll);  // the next lease tells what the matter is
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::jobs

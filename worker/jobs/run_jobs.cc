#include "worker/jobs/run_jobs.h"

#include <exception>
#include <new>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "worker/jobs/job_context.h"
#include "worker/jobs/run_import.h"
#include "worker/jobs/run_part.h"
#include "worker/jobs/run_registration.h"

namespace liquidblend::jobs {
namespace {

// Trouble with the catalog that waiting does not cure.
bool IsFatal(const absl::Status& status) {
  return absl::IsDataLoss(status) || absl::IsPermissionDenied(status);
}

// Trouble that another attempt, perhaps on another machine, may not meet.
bool MayPass(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsResourceExhausted(status) ||
         absl::IsInternal(status);
}

absl::Status RunStages(const store::pb::JobRecord& job, JobContext& context) {
  if (job.has_import_animation()) return RunImport(job.import_animation(), context);
  if (job.has_register_family()) return RunRegistration(job.register_family(), context);
  if (job.has_register_target()) return RunPart(job, context);
  return absl::InvalidArgumentError("the job says nothing to do: it may be from a newer program");
}

// The one place where the worker catches what others throw.
absl::Status RunGuarded(const store::pb::JobRecord& job, JobContext& context) {
  try {
    return RunStages(job, context);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(
        absl::StrCat("out of memory in stage '", context.stage(), "'"));
  } catch (const std::exception& error) {
    return absl::InternalError(
        absl::StrCat("unexpected in stage '", context.stage(), "': ", error.what()));
  }
}

// Why the stages ended: a job that was not to go on may have met that as any error of a stage.
absl::Status Outcome(const absl::Status& stages, const LeaseKeeper& keeper) {
  const absl::Status kept = keeper.Check();
  return stages.ok() || kept.ok() ? stages : kept;
}

// Tells the catalog how the job ended. A published job has ended already; one that is lost, or has
// gone back to the queue, is no longer ours.
void Settle(store::Catalog& catalog, const store::Lease& lease, const absl::Status& outcome,
            bool is_released) {
  if (outcome.ok()) return base::LogInfo(absl::StrCat("job ", lease.job.id(), ": done"));
  base::LogWarning(absl::StrCat("job ", lease.job.id(), ": ", outcome.ToString()));
  if (absl::IsAborted(outcome) || is_released) return;
  const absl::Status settled = catalog.FailJob(lease.lease_id, outcome, MayPass(outcome));
  if (!settled.ok()) {
    base::LogWarning(
        absl::StrCat("job ", lease.job.id(), ": cannot say that it failed: ", settled.ToString()));
  }
}

void RunJob(store::Catalog& catalog, store::BlobStore& blobs, const parallel::Arena& arena,
            const StopSignal& stop, const store::Lease& lease, const LeaseOptions& options) {
  base::LogInfo(absl::StrCat("job ", lease.job.id(), ": attempt ", lease.job.attempts()));
  absl::Status outcome;
  bool is_released = false;
  {
    LeaseKeeper keeper(catalog, lease, stop, options);
    JobContext context(catalog, blobs, arena, keeper);
    outcome = Outcome(RunGuarded(lease.job, context), keeper);
    is_released = absl::IsUnavailable(keeper.Check());
  }
  Settle(catalog, lease, outcome, is_released);
}

}  // namespace

absl::Status JobLoopOptions::Validate() const {
  if (worker.empty()) return absl::InvalidArgumentError("worker must have a name");
  if (poll <= absl::ZeroDuration()) {
    return absl::InvalidArgumentError(
        absl::StrCat("poll is out of range: ", absl::FormatDuration(poll)));
  }
  return lease.Validate();
}

absl::Status RunJobs(store::Catalog& catalog, store::BlobStore& blobs, const parallel::Arena& arena,
                     const StopSignal& stop, const JobLoopOptions& options) {
  LB_RETURN_IF_ERROR(options.Validate());
  while (!stop.is_requested()) {
    absl::StatusOr<std::optional<store::Lease>> lease =
        catalog.LeaseJob(options.worker, options.lease.duration);
    if (lease.ok() && lease->has_value()) {
      RunJob(catalog, blobs, arena, stop, **lease, options.lease);
      continue;
    }
    if (IsFatal(lease.status())) return lease.status();
    if (!lease.ok()) base::LogWarning(absl::StrCat("queue: ", lease.status().ToString()));
    if (lease.ok() && options.exit_when_idle) return absl::OkStatus();
    stop.WaitFor(options.poll);
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::jobs

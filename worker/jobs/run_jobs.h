// The job loop: leases jobs from the queue, one at a time, and runs each to its end.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/parallel/arena.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "core/trace/tracer.h"
#include "worker/jobs/attempt/access.h"
#include "worker/jobs/attempt/lease_keeper.h"
#include "worker/jobs/attempt/stop_signal.h"
#include "worker/jobs/checkpoints.h"

namespace liquidblend::jobs {

struct JobLoopOptions {
  std::string worker = "worker";  // not empty; shown with the jobs that it takes
  LeaseOptions lease;
  CheckpointOptions checkpoints;
  AccessOptions access;
  // > 0; the longest time between two looks at an empty queue. Catalog::WaitForJob() tells of new
  // jobs sooner.
  absl::Duration poll = absl::Seconds(5);
  int64_t memory_bytes = store::kAnyMemory;  // > 0; jobs that need more are left to others
  // >= 0; returns when it has found nothing to do for so long. Time in which the queue could not be
  // asked does not count.
  absl::Duration idle_time = absl::InfiniteDuration();
  int64_t max_jobs = 0;  // >= 0; returns after so many attempts at jobs; 0: any number
  const trace::Tracer* tracer = nullptr;  // of attempts; outlives the loop; null: none are traced
  // The refusal or loss of access that is known at the start; OK: none.
  absl::Status refusal;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Why RunJobs() returned.
enum class LoopEnd {
  kDrained,  // there was nothing to do for options.idle_time
  kMaxJobs,  // after options.max_jobs
  kStopped,  // `stop` was requested
};

// Runs jobs until `stop` is requested, or an option ends the loop. A job that meets bad input, or
// allocates more memory than it may (run_guarded.h), fails. A job that meets a possibly transient
// error (kUnavailable, kResourceExhausted, kPermissionDenied, kInternal) returns to the queue, see
// Catalog::FailJob(); a job that is interrupted by `stop` returns to it unchanged. Registrations
// resume from their checkpoints (CheckpointOptions). A worker that is refused (kPermissionDenied,
// of the stores in a job or of the queue) takes no jobs until its access is restored (Access). Nor
// does one take the next job before the catalog has heard of the failure of the last one.
// Errors: options out of range; kDataLoss of the catalog; kFailedPrecondition if its tables are of
// a newer program. Other errors are waited out.
absl::StatusOr<LoopEnd> RunJobs(store::Catalog& catalog, store::BlobStore& blobs,
                                const parallel::Arena& arena, const StopSignal& stop,
                                const JobLoopOptions& options);

// Records that this worker takes no jobs for now, because its blob store cannot be opened. Failures
// are ignored.
void RecordRefusal(store::Catalog& catalog, const JobLoopOptions& options,
                   const absl::Status& refusal);

}  // namespace liquidblend::jobs

// The job loop: leases jobs from the queue, one at a time, and runs each to its end.
#pragma once

#include <string>

#include "absl/status/status.h"
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
  absl::Duration poll = absl::Milliseconds(500);  // > 0; interval of looks at an empty queue
  int64_t memory_bytes = store::kAnyMemory;       // > 0; jobs that need more are left to others
  bool exit_when_idle = false;                    // return as soon as the queue is empty
  const trace::Tracer* tracer = nullptr;  // of attempts; outlives the loop; null: none are traced
  // The refusal or loss of access that is known at the start; OK: none.
  absl::Status refusal;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Runs jobs until `stop` is requested. A job that meets bad input, or allocates more memory than it
// may (run_guarded.h), fails. A job that meets a possibly transient error (kUnavailable,
// kResourceExhausted, kPermissionDenied, kInternal) returns to the queue, see Catalog::FailJob(); a
// job that is interrupted by `stop` returns to it unchanged. Registrations resume from their
// checkpoints (CheckpointOptions). A worker that is refused (kPermissionDenied, of the stores in a
// job or of the queue) takes no jobs until its access is restored (Access). Errors: options out of
// range; kDataLoss of the catalog. Other errors are waited out.
absl::Status RunJobs(store::Catalog& catalog, store::BlobStore& blobs, const parallel::Arena& arena,
                     const StopSignal& stop, const JobLoopOptions& options);

// Records that this worker takes no jobs for now, because its blob store cannot be opened. Failures
// are ignored.
void RecordRefusal(store::Catalog& catalog, const JobLoopOptions& options,
                   const absl::Status& refusal);

}  // namespace liquidblend::jobs

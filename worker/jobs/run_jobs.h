// The job loop: takes jobs from the queue, one at a time, and sees each to its end.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "core/parallel/arena.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "worker/jobs/access.h"
#include "worker/jobs/checkpoints.h"
#include "worker/jobs/lease_keeper.h"
#include "worker/jobs/stop_signal.h"

namespace liquidblend::jobs {

struct JobLoopOptions {
  std::string worker = "worker";  // not empty; shown with the jobs that it takes
  LeaseOptions lease;
  CheckpointOptions checkpoints;
  AccessOptions access;
  absl::Duration poll = absl::Milliseconds(500);  // > 0; looks at an empty queue so often, unasked
  int64_t memory_bytes = store::kAnyMemory;       // > 0; jobs that need more are left to others
  bool exit_when_idle = false;                    // return as soon as the queue is empty
  // Why the worker is known to be refused or cut off already; OK: it is not.
  absl::Status refusal;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Runs jobs until `stop` is requested. A job that meets bad input, or allocates more memory than it
// may (run_guarded.h), fails; one that meets trouble which may pass (kUnavailable,
// kResourceExhausted, kPermissionDenied, kInternal) goes back to the queue, as Catalog::FailJob()
// says; one that is interrupted by `stop` goes back as it was. What a registration had come to
// (CheckpointOptions) is gone on from. A worker that is refused (kPermissionDenied, of the stores
// in a job or of the queue) takes no jobs until it is let in again (Access). Errors: options out of
// range; kDataLoss of the catalog. It waits out others.
absl::Status RunJobs(store::Catalog& catalog, store::BlobStore& blobs, const parallel::Arena& arena,
                     const StopSignal& stop, const JobLoopOptions& options);

// Records that this worker takes no jobs for now: its blobs cannot be opened. Failures are ignored.
void RecordRefusal(store::Catalog& catalog, const JobLoopOptions& options,
                   const absl::Status& refusal);

}  // namespace liquidblend::jobs

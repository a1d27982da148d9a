// Renewal of a job's lease while it is worked on.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"
#include "core/store/catalog/catalog.h"
#include "worker/jobs/attempt/stop_signal.h"

namespace liquidblend::jobs {

struct LeaseOptions {
  // From 100 ms to store::kLongestLease; renewed three times within it.
  absl::Duration duration = absl::Seconds(30);
  // > 0; between two reports of progress. Those of a job whose record is longer than 64 KiB are
  // further apart, as each of them writes the whole record: 256 KiB a second, at least one within a
  // third of the duration.
  absl::Duration report_interval = absl::Milliseconds(250);
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Renews the lease and records progress from a separate thread, so that work which reports nothing
// for a while keeps its lease. The thread survives a lack of memory: the next round tries again.
// When the worker is to stop, the job returns to the queue at once, before the work has come to a
// halt.
// Threads: safe.
class LeaseKeeper {
 public:
  //   before_release  called, from the keeper's thread, before the job goes back because of `stop`;
  //                   it must not take much of the time that the worker has to stop. Returns what
  //                   it has saved, for the log: "with a checkpoint after iteration 6"
  // Requires: options.Validate().ok(); catalog and stop outlive this.
  LeaseKeeper(store::Catalog& catalog, store::Lease lease, const StopSignal& stop,
              const LeaseOptions& options, std::function<std::string()> before_release = {});
  ~LeaseKeeper();
  LeaseKeeper(const LeaseKeeper&) = delete;
  LeaseKeeper& operator=(const LeaseKeeper&) = delete;

  const std::string& lease_id() const { return lease_.lease_id; }
  const store::pb::JobRecord& job() const { return lease_.job; }

  // Sets the newest progress, which is sent soon, and again with each renewal.
  void Report(const store::pb::JobProgress& progress);

  // OK if the work may go on. Errors: kCancelled if a cancellation was requested; kAborted if the
  // lease is lost, so that results will be refused; kUnavailable if the worker stops and the job is
  // back in the queue, if the catalog's tables are of a newer program, or while the lease has run
  // out because the catalog cannot be reached: then only the catalog knows if another worker has
  // the job, and this one still tries to renew the lease. Once that succeeds, the work may go on,
  // unless this has returned the error before: errors that were returned stay.
  absl::Status Check() const;

  // The same for a result that is ready: OK, too, if the lease has run out, as the catalog refuses
  // the result if another worker has the job.
  absl::Status CheckForPublishing() const;

  // Whether the worker stops and the job is back in the queue.
  bool is_released() const;

 private:
  void Keep();
  bool IsRenewalDue() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Renew();
  void NoteRenewal(base::SteadyClock::time_point begin, const store::JobControl& control)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Release();
  void End(const absl::Status& reason, bool is_released = false);
  bool HasEnded() const;

  store::Catalog& catalog_;
  const store::Lease lease_;
  const StopSignal& stop_;
  const LeaseOptions options_;
  const absl::Duration report_interval_;  // of this job
  const std::function<std::string()> before_release_;
  mutable absl::Mutex mutex_;
  store::pb::JobProgress progress_ ABSL_GUARDED_BY(mutex_);
  bool is_progress_new_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_done_ ABSL_GUARDED_BY(mutex_) = false;    // the destructor has begun
  bool has_ended_ ABSL_GUARDED_BY(mutex_) = false;  // nothing is renewed any more
  bool is_released_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status state_ ABSL_GUARDED_BY(mutex_);                      // what Check() returns ...
  bool has_run_out_ ABSL_GUARDED_BY(mutex_) = false;                // ... because the lease has
  mutable bool is_error_reported_ ABSL_GUARDED_BY(mutex_) = false;  // Check() has returned one
  base::SteadyCondVar done_;
  base::SteadyClock::time_point renewed_ ABSL_GUARDED_BY(mutex_);
  // When the log was told that it cannot be renewed; nothing since the last renewal.
  std::optional<base::SteadyClock::time_point> warned_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace liquidblend::jobs

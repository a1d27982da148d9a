// Keeps the lease of a job while it is worked on.
#pragma once

#include <functional>
#include <optional>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"
#include "core/store/catalog/catalog.h"
#include "worker/jobs/stop_signal.h"

namespace liquidblend::jobs {

struct LeaseOptions {
  // From 100 ms to store::kLongestLease, which the catalog would cut it to; renewed three times as
  // often.
  absl::Duration duration = absl::Seconds(30);
  absl::Duration report_interval = absl::Milliseconds(250);  // > 0; between two reports of progress
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Renews the lease and tells the catalog of progress from a thread of its own, so that work which
// says nothing for a while loses nothing. A lack of memory does not end it: the next round tries
// again. When the worker is to stop, the job goes back to the
// queue at once: another worker need not wait for this one to come to a halt.
// Threads: safe.
class LeaseKeeper {
 public:
  //   before_release  called, from the keeper's thread, before the job goes back because of `stop`;
  //                   it must not take much of the time that the worker has to stop
  // Requires: options.Validate().ok(); catalog and stop outlive this.
  LeaseKeeper(store::Catalog& catalog, store::Lease lease, const StopSignal& stop,
              const LeaseOptions& options, std::function<void()> before_release = {});
  ~LeaseKeeper();
  LeaseKeeper(const LeaseKeeper&) = delete;
  LeaseKeeper& operator=(const LeaseKeeper&) = delete;

  const std::string& lease_id() const { return lease_.lease_id; }
  const store::pb::JobRecord& job() const { return lease_.job; }

  // The newest progress; sent soon, and again with each renewal.
  void Report(const store::pb::JobProgress& progress);

  // Whether to go on. kCancelled: someone asked for it; kAborted: the lease is lost, whatever the
  // work comes to is refused; kUnavailable: the worker stops, the job is back in the queue.
  absl::Status Check() const;

 private:
  void Keep();
  bool IsRenewalDue() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Renew();
  void Release();
  void End(const absl::Status& reason);

  store::Catalog& catalog_;
  const store::Lease lease_;
  const StopSignal& stop_;
  const LeaseOptions options_;
  const std::function<void()> before_release_;
  mutable absl::Mutex mutex_;
  store::pb::JobProgress progress_ ABSL_GUARDED_BY(mutex_);
  bool is_progress_new_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_done_ ABSL_GUARDED_BY(mutex_) = false;  // the destructor has begun
  absl::Status state_ ABSL_GUARDED_BY(mutex_);    // what Check() returns
  base::SteadyCondVar done_;
  base::SteadyClock::time_point renewed_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace liquidblend::jobs

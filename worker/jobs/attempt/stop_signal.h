// Stop signal of a worker: a request to stop, from any thread.
#pragma once

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"

namespace liquidblend::jobs {

// Threads: safe.
class StopSignal {
 public:
  void Request() {
    absl::MutexLock lock(&mutex_);
    is_requested_ = true;
    changed_.SignalAll();
  }

  bool is_requested() const {
    absl::MutexLock lock(&mutex_);
    return is_requested_;
  }

  // Waits until a stop is requested, at most this long. Returns whether it is.
  bool WaitFor(absl::Duration duration) const {
    absl::MutexLock lock(&mutex_);
    const auto is_requested = [this] {
      mutex_.AssertHeld();
      return is_requested_;
    };
    return changed_.Await(&mutex_, is_requested, duration);
  }

 private:
  mutable absl::Mutex mutex_;
  mutable base::SteadyCondVar changed_;
  bool is_requested_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace liquidblend::jobs

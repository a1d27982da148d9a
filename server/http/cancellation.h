// How an answer on its way hears that nobody waits for it any more.
#pragma once

#include <functional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::http {

// Threads: safe.
class Cancellation {
 public:
  // What Cancel() shall run; if that came before, it runs now.
  void Arm(std::function<void()> cancel) {
    {
      absl::MutexLock lock(&mutex_);
      if (!is_cancelled_) {
        cancel_ = std::move(cancel);
        return;
      }
    }
    cancel();
  }

  void Cancel() {
    std::function<void()> cancel;
    {
      absl::MutexLock lock(&mutex_);
      is_cancelled_ = true;
      cancel.swap(cancel_);
    }
    if (cancel != nullptr) cancel();
  }

 private:
  absl::Mutex mutex_;
  bool is_cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  std::function<void()> cancel_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::http

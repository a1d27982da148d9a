// Cancellation of an answer whose client is gone.
#pragma once

#include <functional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::http {

// Threads: safe.
class Cancellation {
 public:
  // Sets the function that Cancel() runs; if Cancel() came before, it runs now.
  //   number  of the step of the answer that it ends. Steps may arm in any order, on several
  //           threads; only the last step's function counts, as earlier steps are over
  void Arm(int number, std::function<void()> cancel) {
    std::function<void()> former;  // destroyed without the lock
    {
      absl::MutexLock lock(&mutex_);
      if (!is_cancelled_) {
        if (number < number_) return;
        number_ = number;
        former = std::exchange(cancel_, std::move(cancel));
        return;
      }
    }
    cancel();
  }

  bool is_cancelled() const {
    absl::MutexLock lock(&mutex_);
    return is_cancelled_;
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
  mutable absl::Mutex mutex_;
  bool is_cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  int number_ ABSL_GUARDED_BY(mutex_) = 0;
  std::function<void()> cancel_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::http

// Condition variable on a steady clock: setting the machine's clock does not change its waits.
// Abseil's waits go by the time of day; a clock that is turned back by an hour prolongs them by an
// hour.
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace liquidblend::base {

// Clock that goes forward only, whatever happens to the time of day.
using SteadyClock = std::chrono::steady_clock;

// The time since `begin`, a SteadyClock::now().
inline absl::Duration Since(SteadyClock::time_point begin) {
  return absl::FromChrono(SteadyClock::now() - begin);
}

// As absl::CondVar, spurious wake-ups included.  Threads: safe.
class SteadyCondVar {
 public:
  void Wait(absl::Mutex* mutex) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    Lockable lockable{*mutex};
    changed_.wait(lockable);
  }

  // Returns whether the wait timed out.
  bool WaitWithTimeout(absl::Mutex* mutex, absl::Duration timeout)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    Lockable lockable{*mutex};
    const auto span = absl::ToChronoNanoseconds(std::min(timeout, kLongest));
    return changed_.wait_until(lockable, SteadyClock::now() + span) == std::cv_status::timeout;
  }

  // Waits until `condition`, at most this long; returns it.
  template <typename Condition>
  bool Await(absl::Mutex* mutex, const Condition& condition, absl::Duration timeout)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    const SteadyClock::time_point begin = SteadyClock::now();
    while (!condition() && Since(begin) < timeout) WaitWithTimeout(mutex, timeout - Since(begin));
    return condition();
  }

  // Wake one waiting thread, or all of them.
  void Signal() { changed_.notify_one(); }
  void SignalAll() { changed_.notify_all(); }

 private:
  // Adapter of a mutex that the caller holds.
  struct Lockable {
    absl::Mutex& mutex;
    void lock() ABSL_NO_THREAD_SAFETY_ANALYSIS { mutex.Lock(); }
    void unlock() ABSL_NO_THREAD_SAFETY_ANALYSIS { mutex.Unlock(); }
  };

  static constexpr absl::Duration kLongest = absl::Hours(24 * 365);
  std::condition_variable_any changed_;
};

}  // namespace liquidblend::base

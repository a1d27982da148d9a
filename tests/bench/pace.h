// A steady rate for clients.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>

#include "tests/bench/machine_stops.h"

namespace liquidblend::bench {

// Waits until the stop or the end of the span. Returns whether to go on.
inline bool SleepUnlessStopped(Clock::duration span, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock lock(mutex);
  stopped.wait_for(lock, stop, span, [] { return false; });
  return !stop.stop_requested();
}

// At most so many turns a second; turns that are missed are not made up for.
class Turns {
 public:
  // per_second > 0
  Turns(double per_second, std::stop_token stop)
      : period_(std::chrono::duration_cast<Clock::duration>(
            std::chrono::duration<double>(1.0 / per_second))),
        stop_(std::move(stop)) {}

  // Waits for the next turn. False: it is time to stop.
  bool Next() {
    const Clock::time_point now = Clock::now();
    if (next_ < now) next_ = now;
    const bool goes_on = SleepUnlessStopped(next_ - now, stop_);
    next_ += period_;
    return goes_on;
  }

 private:
  const Clock::duration period_;
  const std::stop_token stop_;
  Clock::time_point next_ = Clock::now();
};

}  // namespace liquidblend::bench

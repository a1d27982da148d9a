// When the machine itself did not run, so that nobody takes it for the program's doing.
#pragma once

#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

namespace liquidblend::bench {

using Clock = std::chrono::steady_clock;

struct Interval {
  Clock::time_point begin;
  Clock::time_point end;
};

// From its making to its end, a thread on each core, ahead of all others (SCHED_FIFO), sleeps for
// a millisecond at a time. What it sleeps beyond that is the machine's doing: a virtual one that
// its host stops, say.  Threads: one at a time.
class MachineStops {
 public:
  static constexpr double kShortestMs = 5.0;

  MachineStops();
  ~MachineStops();
  MachineStops(const MachineStops&) = delete;
  MachineStops& operator=(const MachineStops&) = delete;

  // Ends the threads. When some core stood still for longer than kShortestMs, one after the other.
  const std::vector<Interval>& Stop();
  // After Stop(): false without the right to be ahead of others (root's, say); there are no stops
  // then.
  bool is_known() const { return is_known_; }

 private:
  // Of one core; its thread's until that is joined.
  struct Watched {
    bool is_ahead = false;
    std::vector<Interval> stops;
  };

  std::vector<Watched> cores_;
  std::vector<Interval> stops_;
  std::vector<std::jthread> threads_;
  bool is_known_ = true;
};

// How many of `intervals` have a stop within.
int64_t CountTouched(const std::vector<Interval>& intervals, const std::vector<Interval>& stops);

}  // namespace liquidblend::bench

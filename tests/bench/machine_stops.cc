#include "tests/bench/machine_stops.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cstdint>

namespace liquidblend::bench {
namespace {

constexpr std::chrono::milliseconds kNap(1);

// False: the thread may not.
bool PutAhead(pthread_t thread, int core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core, &cores);
  const sched_param priority = {.sched_priority = 1};
  return pthread_setaffinity_np(thread, sizeof(cores), &cores) == 0 &&
         pthread_setschedparam(thread, SCHED_FIFO, &priority) == 0;
}

void Watch(const std::stop_token& stop, std::vector<Interval>& found) {
  Clock::time_point last = Clock::now();
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(kNap);
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double, std::milli> gap = now - last - kNap;
    if (gap.count() > MachineStops::kShortestMs) found.push_back({last + kNap, now});
    last = now;
  }
}

}  // namespace

MachineStops::MachineStops() : of_core_(std::thread::hardware_concurrency()) {
  for (size_t core = 0; core < of_core_.size(); ++core) {
    std::jthread& thread = threads_.emplace_back(
        [&found = of_core_[core]](const std::stop_token& stop) { Watch(stop, found); });
    if (!PutAhead(thread.native_handle(), static_cast<int>(core))) is_known_ = false;
  }
}

MachineStops::~MachineStops() = default;

const std::vector<Interval>& MachineStops::Stop() {
  threads_.clear();
  for (const auto& of_one : of_core_) all_.insert(all_.end(), of_one.begin(), of_one.end());
  of_core_.clear();
  std::sort(all_.begin(), all_.end(),
            [](const Interval& a, const Interval& b) { return a.begin < b.begin; });
  if (!is_known_) all_.clear();
  return all_;
}

int64_t CountTouched(const std::vector<Interval>& intervals, const std::vector<Interval>& stops) {
  return std::count_if(intervals.begin(), intervals.end(), [&](const Interval& interval) {
    return std::any_of(stops.begin(), stops.end(), [&](const Interval& stop) {
      return stop.begin < interval.end && stop.end > interval.begin;
    });
  });
}

}  // namespace liquidblend::bench

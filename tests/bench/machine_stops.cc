#include "tests/bench/machine_stops.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <stop_token>
#include <utility>

namespace liquidblend::bench {
namespace {

constexpr std::chrono::milliseconds kNap(1);

// False: the thread may not.
bool PutThisThreadAhead(int core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core, &cores);
  const sched_param priority = {.sched_priority = 1};
  return pthread_setaffinity_np(pthread_self(), sizeof(cores), &cores) == 0 &&
         pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) == 0;
}

std::vector<Interval> Watch(const std::stop_token& stop) {
  std::vector<Interval> found;
  Clock::time_point last = Clock::now();
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(kNap);
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double, std::milli> gap = now - last - kNap;
    if (gap.count() > MachineStops::kShortestMs) found.push_back({last + kNap, now});
    last = now;
  }
  return found;
}

// One for all that overlap.
std::vector<Interval> Unite(std::vector<Interval> intervals) {
  std::sort(intervals.begin(), intervals.end(),
            [](const Interval& a, const Interval& b) { return a.begin < b.begin; });
  std::vector<Interval> united;
  for (const Interval& interval : intervals) {
    if (united.empty() || united.back().end < interval.begin) {
      united.push_back(interval);
    } else {
      united.back().end = std::max(united.back().end, interval.end);
    }
  }
  return united;
}

}  // namespace

MachineStops::MachineStops() : cores_(std::thread::hardware_concurrency()) {
  for (size_t core = 0; core < cores_.size(); ++core) {
    threads_.emplace_back([core, &watched = cores_[core]](const std::stop_token& stop) {
      watched.is_ahead = PutThisThreadAhead(static_cast<int>(core));
      if (watched.is_ahead) watched.stops = Watch(stop);
    });
  }
}

MachineStops::~MachineStops() = default;

const std::vector<Interval>& MachineStops::Stop() {
  threads_.clear();
  std::vector<Interval> all;
  for (const Watched& core : cores_) {
    is_known_ &= core.is_ahead;
    all.insert(all.end(), core.stops.begin(), core.stops.end());
  }
  if (is_known_) stops_ = Unite(std::move(all));
  return stops_;
}

int64_t CountTouched(const std::vector<Interval>& intervals, const std::vector<Interval>& stops) {
  return std::count_if(intervals.begin(), intervals.end(), [&](const Interval& interval) {
    return std::any_of(stops.begin(), stops.end(), [&](const Interval& stop) {
      return stop.begin < interval.end && stop.end > interval.begin;
    });
  });
}

}  // namespace liquidblend::bench

// Memory and processor time of a process.
#pragma once

#include <sys/types.h>

#include <thread>

#include "absl/status/statusor.h"
#include "tests/bench/machine_stops.h"

namespace liquidblend::bench {

struct ProcessUsage {
  double resident_mb = 0.0;
  double cpu_s = 0.0;  // of all its threads since its start
};

// From /proc.  Errors: kUnavailable if there is no such process.
absl::StatusOr<ProcessUsage> UsageOf(pid_t pid);

// Looks at a process' memory twice a second, on a thread of its own, until it is destroyed or
// stopped.
class MemoryWatch {
 public:
  explicit MemoryWatch(pid_t pid);

  // Ends the watch. The largest resident memory that was seen, MB.
  double Stop();

 private:
  double largest_mb_ = 0.0;
  std::jthread thread_;  // writes it until it is joined
};

}  // namespace liquidblend::bench

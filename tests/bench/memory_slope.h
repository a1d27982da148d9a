// Whether a process' memory grows.
#pragma once

#include <sys/types.h>

#include <thread>
#include <vector>

namespace liquidblend::bench {

// Looks at a process' resident memory once a second from its making to Print().
class MemorySlope {
 public:
  explicit MemorySlope(pid_t pid);

  // The slope of the line that fits best, without the first fifth: memory that is filled once.
  void Print();

 private:
  std::vector<double> megabytes_;  // by second
  std::jthread thread_;            // writes megabytes_ until it is joined
};

}  // namespace liquidblend::bench

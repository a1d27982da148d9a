// Whether a process' memory grows.
#pragma once

#include <thread>
#include <vector>

namespace liquidblend::bench {

// Looks at the resident memory of this process once a second from its making to Print().
class MemorySlope {
 public:
  MemorySlope();

  // The slope of the line that fits best, without the first fifth: memory that is filled once.
  void Print();

 private:
  std::vector<double> megabytes_;  // by second
  std::jthread thread_;            // writes megabytes_ until it is joined
};

}  // namespace liquidblend::bench

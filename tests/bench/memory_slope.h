// Whether a server's memory grows.
#pragma once

#include <thread>
#include <vector>

#include "tests/bench/load_server.h"

namespace liquidblend::bench {

// Looks at its memory every second from its making to Print(); leaves out what it is not told.
class MemorySlope {
 public:
  // The server must outlive it.
  explicit MemorySlope(const LoadServer& server);

  // Means of each tenth of the time, and the slopes of the lines that fit best, without the first
  // fifth: memory that is filled once.
  void Print();

 private:
  std::vector<double> resident_mb_, heap_used_mb_;  // by second since its making, nearly
  std::jthread thread_;                             // writes them until it is joined
};

}  // namespace liquidblend::bench

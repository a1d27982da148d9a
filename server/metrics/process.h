// What the operating system says of this process.
#pragma once

#include <cstdint>

namespace liquidblend::metrics {

// Zero where /proc does not tell.
struct ProcessFigures {
  int64_t resident_bytes = 0;
  int64_t virtual_bytes = 0;
  int64_t heap_used_bytes = 0;  // allocated; with what threads keep of small blocks they freed
  int64_t heap_free_bytes = 0;  // freed and kept for what is allocated next
  double cpu_s = 0.0;  // user and system, since the start
  int64_t num_open_files = 0;
  int64_t max_open_files = 0;
  int64_t num_threads = 0;
};

// Cost: some 50 microseconds.
ProcessFigures ReadProcessFigures();

}  // namespace liquidblend::metrics

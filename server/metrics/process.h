// What the operating system says of this process.
#pragma once

#include <cstdint>

#include "core/base/memory.h"

namespace liquidblend::metrics {

// Zero where /proc does not tell.
struct ProcessFigures {
  int64_t resident_bytes = 0;
  int64_t virtual_bytes = 0;
  base::HeapBytes heap;
  double cpu_s = 0.0;  // user and system, since the start
  int64_t num_open_files = 0;
  int64_t max_open_files = 0;
  int64_t num_threads = 0;
};

// Cost: some 100 microseconds.
ProcessFigures ReadProcessFigures();

}  // namespace liquidblend::metrics

// Figures of this process from the operating system.
#pragma once

#include <cstdint>

#include "core/base/memory.h"

namespace liquidblend::metrics {

// Zero for figures that /proc does not have.
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

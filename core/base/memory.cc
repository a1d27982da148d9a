#include "core/base/memory.h"

#include <malloc.h>

namespace liquidblend::base {

void ReturnLargeBlocks() { mallopt(M_MMAP_THRESHOLD, 1 << 20); }

void KeepFreedMemory() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
}

void ReturnFreeMemory() { malloc_trim(0); }

}  // namespace liquidblend::base

#include "core/base/memory.h"

#include <malloc.h>

namespace liquidblend::base {

void ReturnLargeBlocks() { mallopt(M_MMAP_THRESHOLD, 1 << 20); }

void ReturnFreeMemory() { malloc_trim(0); }

}  // namespace liquidblend::base

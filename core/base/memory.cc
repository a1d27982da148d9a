#include "core/base/memory.h"

#include <malloc.h>

#include <algorithm>
#include <cstddef>

// Defined only if the program is linked with jemalloc.
extern "C" __attribute__((weak)) int mallctl(const char* name, void* old_value, size_t* old_size,
                                             void* new_value, size_t new_size) noexcept;

namespace liquidblend::base {
namespace {

int64_t JemallocFigure(const char* name) {
  size_t value = 0, size = sizeof(value);
  return mallctl(name, &value, &size, nullptr, 0) == 0 ? static_cast<int64_t>(value) : 0;
}

HeapBytes ReadJemalloc() {
  uint64_t epoch = 1;  // setting this updates the figures
  mallctl("epoch", nullptr, nullptr, &epoch, sizeof(epoch));
  HeapBytes heap;
  heap.used = JemallocFigure("stats.allocated");
  heap.free = std::max<int64_t>(0, JemallocFigure("stats.resident") - heap.used);
  return heap;
}

// Initializes the heap of glibc before there are threads. If another allocator replaces it (that of
// a sanitizer, or one of LD_PRELOAD), it is initialized by the first call of mallinfo2, and two
// threads that do so at once make glibc abort.
[[maybe_unused]] const struct mallinfo2 kHeapAtStart = mallinfo2();

}  // namespace

void ReturnLargeBlocks() { mallopt(M_MMAP_THRESHOLD, 1 << 20); }

void ReturnFreeMemory() { malloc_trim(0); }

HeapBytes ReadHeap() {
  if (mallctl != nullptr) return ReadJemalloc();
  const struct mallinfo2 heap = mallinfo2();
  return {static_cast<int64_t>(heap.uordblks + heap.hblkhd), static_cast<int64_t>(heap.fordblks)};
}

}  // namespace liquidblend::base

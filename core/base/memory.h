// Memory that a process has freed but still occupies.
#pragma once

#include <cstdint>

namespace liquidblend::base {

// Blocks of a MiB and more go back to the system as soon as they are freed, whatever was freed
// before, so that the peak of a process is what it holds at once. Call once in main, before threads
// start. Cost: the pages of such blocks are cleared again when they are allocated.
void ReturnLargeBlocks();

// Gives back what smaller blocks have left free.  Threads: safe.  Cost: milliseconds.
void ReturnFreeMemory();

struct HeapBytes {
  int64_t used = 0;  // allocated; of glibc's heap with what threads keep of small blocks they freed
  int64_t free = 0;  // kept for what is allocated next; of jemalloc's with its own books
};

// Of the process' allocator, jemalloc's or glibc's.  Threads: safe.  Cost: some 50 microseconds.
HeapBytes ReadHeap();

}  // namespace liquidblend::base

// Return of freed memory from the process to the system, and the size of the heap.
#pragma once

#include <cstdint>

namespace liquidblend::base {

// Makes blocks of a MiB and more return to the system as soon as they are freed, so that the peak
// of a process is the memory that it uses at one time. Call once in main, before threads start.
// Cost: the pages of such blocks are cleared again when they are allocated.
void ReturnLargeBlocks();

// Returns the free memory of smaller blocks.  Threads: safe.  Cost: milliseconds.
void ReturnFreeMemory();

// Size of the heap, in bytes.
struct HeapBytes {
  int64_t used = 0;  // allocated; of glibc's heap with what threads keep of small blocks they freed
  int64_t free = 0;  // kept for what is allocated next; of jemalloc's with its own books
};

// Reads the heap of the process' allocator, jemalloc's or glibc's.  Threads: safe.  Cost: some 50
// microseconds.
HeapBytes ReadHeap();

}  // namespace liquidblend::base

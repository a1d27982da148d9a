// Prefetching of memory into the cache.
#pragma once

namespace liquidblend::base {

// Fetches a cache line into the second-level cache. For code that fetches many lines at a time: the
// first-level cache has room for few outstanding misses, and computing code would wait for them
// (docs/experiments/slicing.md).
inline void PrefetchIntoL2(const void* line) { __builtin_prefetch(line, 0, 2); }

}  // namespace liquidblend::base

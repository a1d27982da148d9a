// Memory on its way before it is needed.
#pragma once

namespace liquidblend::base {

// Fetches a cache line into the second cache. Where many lines are on their way at a time: the
// first cache has room for few misses, and whoever computes meanwhile would wait for a place
// (docs/experiments/slicing.md).
inline void PrefetchIntoL2(const void* line) { __builtin_prefetch(line, 0, 2); }

}  // namespace liquidblend::base

// For tests in which allocations fail.
#pragma once

#include <gtest/gtest.h>

// 1 if a sanitizer replaces the heap, with GCC and Clang.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define LIQUIDBLEND_SANITIZED_HEAP 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define LIQUIDBLEND_SANITIZED_HEAP 1
#endif
#endif
#ifndef LIQUIDBLEND_SANITIZED_HEAP
#define LIQUIDBLEND_SANITIZED_HEAP 0
#endif

namespace liquidblend::allocation {

// Sanitizers end a program whose allocation fails, instead of throwing std::bad_alloc.
inline constexpr bool kAllocationsMayFail = LIQUIDBLEND_SANITIZED_HEAP == 0;

}  // namespace liquidblend::allocation

// First in a test in which allocations fail.
#define LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL()              \
  do {                                                     \
    if (!::liquidblend::allocation::kAllocationsMayFail) { \
      GTEST_SKIP() << "sanitizers end the program";        \
    }                                                      \
  } while (false)

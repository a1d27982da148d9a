// For tests in which allocations fail.
#pragma once

#include <gtest/gtest.h>

namespace liquidblend::allocation {

// Sanitizers end a program whose allocation fails, instead of throwing std::bad_alloc.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kAllocationsMayFail = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kAllocationsMayFail = false;
#else
inline constexpr bool kAllocationsMayFail = true;
#endif
#else
inline constexpr bool kAllocationsMayFail = true;
#endif

}  // namespace liquidblend::allocation

// First in a test in which allocations fail.
#define LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL()              \
  do {                                                     \
    if (!::liquidblend::allocation::kAllocationsMayFail) { \
      GTEST_SKIP() << "sanitizers end the program";        \
    }                                                      \
  } while (false)

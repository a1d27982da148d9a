// How much memory the process has allocated and not freed.
#pragma once

#include <malloc.h>

#include <cstddef>

// AddressSanitizer's own count; without it the symbol is null.
extern "C" size_t __sanitizer_get_current_allocated_bytes() __attribute__((weak));

namespace liquidblend::fuzz {

inline size_t AllocatedBytes() {
  if (&__sanitizer_get_current_allocated_bytes != nullptr) {
    return __sanitizer_get_current_allocated_bytes();
  }
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

}  // namespace liquidblend::fuzz

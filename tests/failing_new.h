// Memory that runs out when a test says so. To be included by one source of a test's program, whose
// operator new it replaces.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#include "tests/allocation_testing.h"

namespace liquidblend::testing_memory {

inline std::atomic<size_t> smallest_failing = SIZE_MAX;
inline std::atomic<int> num_before_failure = 0;
inline thread_local int num_before_own_failure = -1;  // of this thread; < 0: none fails

// From now on the n-th (from 0) allocation of at least this size fails, and all later ones that are
// as large, until the end of the object's life.
class FailingNew {
 public:
  FailingNew(size_t min_bytes, int n) {
    num_before_failure = n;
    smallest_failing = min_bytes;
  }
  ~FailingNew() { smallest_failing = SIZE_MAX; }
  FailingNew(const FailingNew&) = delete;
  FailingNew& operator=(const FailingNew&) = delete;

  static bool has_failed() { return num_before_failure < 0; }
};

// The n-th (from 0) allocation of this thread fails, whatever its size, and no other one.
class FailingOnce {
 public:
  explicit FailingOnce(int n) { num_before_own_failure = n; }
  ~FailingOnce() { num_before_own_failure = -1; }
  FailingOnce(const FailingOnce&) = delete;
  FailingOnce& operator=(const FailingOnce&) = delete;

  // To be asked before its end.
  static bool has_failed() { return num_before_own_failure < 0; }
};

inline void* Allocate(size_t size) {
  if (size >= smallest_failing && num_before_failure-- <= 0) throw std::bad_alloc();
  if (num_before_own_failure >= 0 && num_before_own_failure-- == 0) throw std::bad_alloc();
  void* const memory = std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace liquidblend::testing_memory

// A sanitizer has operators of its own; tests skip themselves there (allocation_testing.h).
#if LIQUIDBLEND_SANITIZED_HEAP == 0
void* operator new(size_t size) { return liquidblend::testing_memory::Allocate(size); }
void* operator new[](size_t size) { return liquidblend::testing_memory::Allocate(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t) noexcept { std::free(memory); }
#endif

// Budget of memory that many requests share.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

namespace liquidblend::http {

// Owned by a shared_ptr.  Threads: safe.
class MemoryBudget : public std::enable_shared_from_this<MemoryBudget> {
 public:
  explicit MemoryBudget(int64_t max_bytes) : max_bytes_(max_bytes), left_bytes_(max_bytes) {}

  bool Take(int64_t num_bytes) {
    if (left_bytes_.fetch_sub(num_bytes) >= num_bytes) return true;
    GiveBack(num_bytes);
    return false;
  }
  void GiveBack(int64_t num_bytes) { left_bytes_.fetch_add(num_bytes); }

  // Takes bytes until the result is destroyed; null: there are not so many left. If nothing else is
  // taken, any number is there: a limit is for what adds up.
  std::shared_ptr<void> Hold(int64_t num_bytes) {
    const int64_t left_before = left_bytes_.fetch_sub(num_bytes);
    if (left_before < num_bytes && left_before != max_bytes_) {
      GiveBack(num_bytes);
      return nullptr;
    }
    return {this, [budget = shared_from_this(), num_bytes](void*) { budget->GiveBack(num_bytes); }};
  }

 private:
  const int64_t max_bytes_;
  std::atomic<int64_t> left_bytes_;
};

}  // namespace liquidblend::http

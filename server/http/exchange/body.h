// Bodies of requests: who takes them piece by piece, and the memory that all of them share. Knows
// no sockets.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"

namespace liquidblend::http {

// The consumer of a body.  Threads: one at a time.
class BodySink {
 public:
  virtual ~BodySink() = default;

  // Takes the next piece; the last one may be empty. Calls `next` once it has room for another
  // one: at once or on another thread; not after the last one, nor once it has refused the body.
  virtual void Take(std::string_view piece, bool is_last, absl::AnyInvocable<void()> next) = 0;
};

// Memory for bodies that wait to be whole, or for their answer.  Threads: safe.
class BodyBudget {
 public:
  explicit BodyBudget(int64_t max_bytes) : left_bytes_(max_bytes) {}

  bool Take(int64_t num_bytes) {
    if (left_bytes_.fetch_sub(num_bytes) >= num_bytes) return true;
    GiveBack(num_bytes);
    return false;
  }
  void GiveBack(int64_t num_bytes) { left_bytes_.fetch_add(num_bytes); }

 private:
  std::atomic<int64_t> left_bytes_;
};

// A body whose bytes are taken from a budget, and given back with it.
class HeldBody {
 public:
  explicit HeldBody(BodyBudget& budget) : budget_(budget) {}
  ~HeldBody() { budget_.GiveBack(static_cast<int64_t>(bytes_.size())); }
  HeldBody(const HeldBody&) = delete;
  HeldBody& operator=(const HeldBody&) = delete;

  // False, and the piece is dropped: the budget is used up.
  bool Append(std::string_view piece) {
    if (!budget_.Take(static_cast<int64_t>(piece.size()))) return false;
    bytes_.append(piece);
    return true;
  }

  const std::string& bytes() const { return bytes_; }

 private:
  BodyBudget& budget_;
  std::string bytes_;
};

}  // namespace liquidblend::http

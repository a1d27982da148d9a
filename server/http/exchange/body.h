// Bodies of requests: who takes them piece by piece, and those that are held in memory. Knows no
// sockets.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "server/http/exchange/memory_budget.h"

namespace liquidblend::http {

// The consumer of a body.  Threads: one at a time.
class BodySink {
 public:
  virtual ~BodySink() = default;

  // Takes the next piece; the last one may be empty. Calls `next` once it has room for another
  // one: at once or on another thread; not after the last one, nor once it has refused the body.
  virtual void Take(std::string_view piece, bool is_last, absl::AnyInvocable<void()> next) = 0;
};

// A body whose bytes are taken from a budget, and given back with it.
class HeldBody {
 public:
  explicit HeldBody(std::shared_ptr<MemoryBudget> budget) : budget_(std::move(budget)) {}
  ~HeldBody() { budget_->GiveBack(static_cast<int64_t>(bytes_.size())); }
  HeldBody(const HeldBody&) = delete;
  HeldBody& operator=(const HeldBody&) = delete;

  // False, and the piece is dropped: the budget is used up.
  bool Append(std::string_view piece) {
    bytes_.reserve(bytes_.size() + piece.size());  // may throw, so before anything is taken
    if (!budget_->Take(static_cast<int64_t>(piece.size()))) return false;
    bytes_.append(piece);
    return true;
  }

  const std::string& bytes() const { return bytes_; }

 private:
  const std::shared_ptr<MemoryBudget> budget_;
  std::string bytes_;
};

}  // namespace liquidblend::http

// Union-find: disjoint sets of numbers.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace liquidblend::mesh {

// Disjoint sets of the numbers from 0 to count - 1; each is a set of its own at first. Threads: one
// at a time.  Cost: nearly O(1) a call.
class UnionFind {
 public:
  explicit UnionFind(int64_t count) : parent_(static_cast<size_t>(count)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  // The lowest number of n's set.
  int32_t Root(int32_t n) {
    while (parent_[n] != n) n = parent_[n] = parent_[parent_[n]];
    return n;
  }
  // Joins the sets of a and b.
  void Join(int32_t a, int32_t b) {
    const auto [low, high] = std::minmax({Root(a), Root(b)});
    parent_[high] = low;
  }

 private:
  std::vector<int32_t> parent_;
};

}  // namespace liquidblend::mesh

// Parallel loops of a stage. No other code of a stage starts threads (TBB; std::jthread under the
// tsan preset, because ThreadSanitizer cannot see into Debian's TBB).
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <numeric>
#include <vector>

#include "absl/functional/function_ref.h"

namespace liquidblend::parallel {

// A fixed number of threads that a caller hands to a stage.
//
// Every function below gives the same result for any number of threads as long as the body for one
// index does not depend on the others: indices are cut into chunks of a fixed size, and reductions
// add the chunks in order.
// Threads: safe; several callers may run work in one arena at a time.
class Arena {
 public:
  // num_threads <= 0: one per core that this process may use.
  explicit Arena(int num_threads = 0);
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  int num_threads() const;

  // Calls task(k) once for each k in [0, num_tasks), in any order, and returns when all are done.
  void Run(int64_t num_tasks, absl::FunctionRef<void(int64_t)> task) const;

  // Calls body(chunk, begin, end) for consecutive chunks of chunk_size indices.
  template <typename Body>
  void ForChunks(int64_t count, int64_t chunk_size, Body&& body) const {
    const int64_t num_chunks = (count + chunk_size - 1) / chunk_size;
    Run(num_chunks, [&](int64_t chunk) {
      body(chunk, chunk * chunk_size, std::min(count, (chunk + 1) * chunk_size));
    });
  }

  // Calls body(i) for each i in [0, count). body(i) may write only data that index i owns.
  template <typename Body>
  void For(int64_t count, Body&& body, int64_t chunk_size = 512) const {
    ForChunks(count, chunk_size, [&](int64_t, int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) body(i);
    });
  }

  // Sum of value(i) over [0, count), added in fixed chunks: the same bytes at any thread count.
  template <typename Value>
  double Sum(int64_t count, Value&& value) const {
    constexpr int64_t kChunk = 4096;
    std::vector<double> partial((count + kChunk - 1) / kChunk, 0.0);
    ForChunks(count, kChunk, [&](int64_t chunk, int64_t begin, int64_t end) {
      double sum = 0.0;
      for (int64_t i = begin; i < end; ++i) sum += value(i);
      partial[chunk] = sum;
    });
    return std::accumulate(partial.begin(), partial.end(), 0.0);
  }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace liquidblend::parallel

#include "tests/bench/memory_slope.h"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <numeric>
#include <span>

namespace liquidblend::bench {
namespace {

// Per second.
double SlopeOf(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0.0, sum_k = 0.0, sum_kk = 0.0, sum_kv = 0.0;
  for (size_t k = 0; k < values.size(); ++k) {
    const auto x = static_cast<double>(k);
    sum += values[k];
    sum_k += x;
    sum_kk += x * x;
    sum_kv += x * values[k];
  }
  const double spread = n * sum_kk - sum_k * sum_k;
  return spread > 0.0 ? (n * sum_kv - sum_k * sum) / spread : 0.0;
}

double MeanOf(std::span<const double> values) {
  return values.empty() ? 0.0
                        : std::accumulate(values.begin(), values.end(), 0.0) /
                              static_cast<double>(values.size());
}

void PrintRow(const char* name, std::span<const double> megabytes) {
  constexpr size_t kNumParts = 10;
  std::printf("| %s", name);
  for (size_t part = 0; part < kNumParts; ++part) {
    const size_t begin = megabytes.size() * part / kNumParts;
    const size_t end = megabytes.size() * (part + 1) / kNumParts;
    std::printf(" | %.1f", MeanOf(megabytes.subspan(begin, end - begin)));
  }
  std::printf(" | %+.2f |\n", 60.0 * SlopeOf(megabytes.subspan(megabytes.size() / 5)));
}

}  // namespace

MemorySlope::MemorySlope(const LoadServer& server)
    : thread_([this, &server](const std::stop_token& stop) {
        std::mutex mutex;
        std::condition_variable_any stopped;
        std::unique_lock lock(mutex);
        auto next = std::chrono::steady_clock::now();
        while (!stop.stop_requested()) {
          const absl::StatusOr<MemoryFigures> now = server.ReadMemory();
          if (now.ok()) {
            resident_mb_.push_back(now->resident_mb);
            heap_used_mb_.push_back(now->heap_used_mb);
          }
          next += std::chrono::seconds(1);
          stopped.wait_until(lock, stop, next, [] { return false; });
        }
      }) {}

void MemorySlope::Print() {
  thread_.request_stop();
  thread_.join();
  std::printf(
      "\n| the server's memory in %zu s, MB by tenths | 1 | 2 | 3 | 4 | 5 | 6 | 7 | 8 | 9 | 10 | "
      "MB a minute from the third on |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
      resident_mb_.size());
  PrintRow("resident", resident_mb_);
  PrintRow("heap, used", heap_used_mb_);
}

}  // namespace liquidblend::bench

#include "tests/bench/memory_slope.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <span>

#include "absl/strings/str_cat.h"

namespace liquidblend::bench {
namespace {

// 0 once it has ended.
double ResidentMegabytes(pid_t pid) {
  std::ifstream file(absl::StrCat("/proc/", pid, "/statm"));
  int64_t virtual_pages = 0, resident_pages = 0;
  file >> virtual_pages >> resident_pages;
  return static_cast<double>(resident_pages * sysconf(_SC_PAGESIZE)) / 1e6;
}

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

}  // namespace

MemorySlope::MemorySlope(pid_t pid)
    : thread_([this, pid](const std::stop_token& stop) {
        std::mutex mutex;
        std::condition_variable_any stopped;
        std::unique_lock lock(mutex);
        while (!stop.stop_requested()) {
          megabytes_.push_back(ResidentMegabytes(pid));
          stopped.wait_for(lock, stop, std::chrono::seconds(1), [] { return false; });
        }
      }) {}

void MemorySlope::Print() {
  thread_.request_stop();
  thread_.join();
  const auto warm = std::span(megabytes_).subspan(megabytes_.size() / 5);
  const auto [lowest, highest] = std::minmax_element(warm.begin(), warm.end());
  std::printf(
      "\nThe server's resident memory in %zu s after a warm-up of %zu s: %.0f MB first, %.0f MB "
      "last, %.0f to "
      "%.0f MB, slope %+.2f MB a minute\n",
      warm.size(), megabytes_.size() - warm.size(), warm.front(), warm.back(), *lowest, *highest,
      60.0 * SlopeOf(warm));
}

}  // namespace liquidblend::bench

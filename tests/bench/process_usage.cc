#include "tests/bench/process_usage.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/bench/pace.h"

namespace liquidblend::bench {

absl::StatusOr<ProcessUsage> UsageOf(pid_t pid) {
  constexpr int kFieldsBeforeTimes = 11;  // after the name, up to utime and stime
  const std::string folder = absl::StrCat("/proc/", pid);
  std::ifstream memory(folder + "/statm");
  std::ifstream times(folder + "/stat");
  double num_pages = 0.0, resident_pages = 0.0;
  std::string line;
  if (!(memory >> num_pages >> resident_pages) || !std::getline(times, line)) {
    return absl::UnavailableError(absl::StrCat("there is no process ", pid));
  }
  std::istringstream fields(line.substr(line.rfind(')') + 1));
  std::string skipped;
  for (int k = 0; k < kFieldsBeforeTimes; ++k) fields >> skipped;
  double user = 0.0, system = 0.0;
  fields >> user >> system;
  return ProcessUsage{resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6,
                      (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK))};
}

MemoryWatch::MemoryWatch(pid_t pid)
    : thread_([this, pid](const std::stop_token& stop) {
        do {
          const absl::StatusOr<ProcessUsage> usage = UsageOf(pid);
          if (usage.ok()) largest_mb_ = std::max(largest_mb_, usage->resident_mb);
        } while (SleepUnlessStopped(std::chrono::milliseconds(500), stop));
      }) {}

double MemoryWatch::Stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  return largest_mb_;
}

}  // namespace liquidblend::bench

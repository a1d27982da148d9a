#include "core/base/cores.h"

#include <sched.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <thread>

#include "core/base/control_groups.h"

namespace liquidblend::base {
namespace {

constexpr char kVersion1Quota[] = "cpu.cfs_quota_us";
constexpr char kVersion1Period[] = "cpu.cfs_period_us";

int NumCoresOfAffinity() {
  cpu_set_t cores;
  if (sched_getaffinity(0, sizeof(cores), &cores) == 0) return CPU_COUNT(&cores);
  return static_cast<int>(std::thread::hardware_concurrency());
}

// The lower of num_cores and a quota: "150000 100000" is 1.5 cores, rounded up to 2; "max 100000",
// -1, or no such file is no quota.
int WithQuota(std::istream& text, int num_cores) {
  int64_t quota_us = 0;
  int64_t period_us = 0;
  if (!(text >> quota_us >> period_us) || quota_us <= 0 || period_us <= 0) return num_cores;
  const int64_t quota_cores = quota_us / period_us + (quota_us % period_us != 0 ? 1 : 0);
  return static_cast<int>(std::min<int64_t>(num_cores, quota_cores));
}

// Version 1 has quota and period in two files.
int WithQuotaIn(const std::string& path, int num_cores) {
  std::ifstream file(path);
  const size_t name = path.rfind('/') + 1;
  if (path.substr(name) != kVersion1Quota) return WithQuota(file, num_cores);
  std::ifstream period(path.substr(0, name) + kVersion1Period);
  std::stringstream both;
  both << file.rdbuf() << " " << period.rdbuf();
  return WithQuota(both, num_cores);
}

}  // namespace

int NumCores() { return NumCoresUnder("", NumCoresOfAffinity()); }

int NumCoresUnder(const std::string& root, int num_cores) {
  for (const std::string& path : PathsInGroups(root, {"cpu", kVersion1Quota, "cpu.max"})) {
    num_cores = WithQuotaIn(path, num_cores);
  }
  return std::max(1, num_cores);
}

int ShareOfCores(int num_cores, int num_sharing) {
  return std::max(1, num_cores / std::max(1, num_sharing));
}

}  // namespace liquidblend::base

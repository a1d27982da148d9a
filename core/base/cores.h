// How many processor cores this process may use.
#pragma once

#include <string>

namespace liquidblend::base {

// At least 1. The least of the cores that the process may run on (its affinity) and the CPU quotas
// of its control groups, its own and those above it (cpu.max, or cpu.cfs_quota_us of version 1),
// rounded up to whole cores.
int NumCores();

// The same of the given number of cores, with another root for /proc and /sys, for tests.
int NumCoresUnder(const std::string& root, int num_cores);

// What each of `num_sharing` processes gets of so many cores: at least 1; all if they are fewer
// than two.
int ShareOfCores(int num_cores, int num_sharing);

}  // namespace liquidblend::base

// Number of processor cores that this process may use.
#pragma once

#include <string>

namespace liquidblend::base {

// The number of cores, at least 1: the least of the cores that the process may run on (its
// affinity) and the CPU quotas of its control groups, its own and those above it (cpu.max, or
// cpu.cfs_quota_us of version 1), rounded up to whole cores.
int NumCores();

// For tests: the same for a given affinity of num_cores, with another root for /proc and /sys.
int NumCoresUnder(const std::string& root, int num_cores);

// The number of cores for each of `num_sharing` processes that share num_cores: at least 1; all of
// them if fewer than two processes share.
int ShareOfCores(int num_cores, int num_sharing);

}  // namespace liquidblend::base

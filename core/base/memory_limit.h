// Memory of this machine, or of the container that the process is in.
#pragma once

#include <cstdint>
#include <string>

namespace liquidblend::base {

// The memory in bytes: the least of the machine's memory and the limits of the process' control
// groups (version 2 or 1, its own group and those above it); 0 if none of them is known.
int64_t MemoryLimit();

// Memory in bytes for a job, where jobs run one at a time: four fifths of MemoryLimit(); 0 if that
// is not known.
int64_t MemoryForJobs();

// The same as MemoryLimit() with another root for /proc and /sys, for tests.
int64_t MemoryLimitUnder(const std::string& root);

// The size as text for people: "12.5 GiB", "300 MiB", "17 bytes".
std::string FormatGibibytes(int64_t bytes);

// The exact size in the form that flags take: "4MiB", "64GiB", "17".
std::string FormatSize(int64_t bytes);

}  // namespace liquidblend::base

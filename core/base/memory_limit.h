// How much memory this machine, or the container that the process is in, has.
#pragma once

#include <cstdint>
#include <string>

namespace liquidblend::base {

// Bytes. The least of the machine's memory and the limits of the process' control groups (version 2
// or 1, its own group and those above it); 0 if nothing can be found out.
int64_t MemoryLimit();

// What jobs may need that are done here one at a time: four fifths of it; 0 if it is not known.
int64_t MemoryForJobs();

// The same as MemoryLimit() with another root for /proc and /sys, for tests.
int64_t MemoryLimitUnder(const std::string& root);

// "12.5 GiB", "300 MiB", "17 bytes".
std::string FormatGibibytes(int64_t bytes);

// Exactly, as flags take it: "4MiB", "64GiB", "17".
std::string FormatSize(int64_t bytes);

}  // namespace liquidblend::base

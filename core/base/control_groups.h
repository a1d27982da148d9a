// The control groups (cgroups) of this process, where the kernel keeps its limits.
#pragma once

#include <string>
#include <vector>

namespace liquidblend::base {

// Name of a limit file in each version of control groups.
struct GroupFile {
  std::string controller;  // of version 1: "memory"
  std::string version1;    // "memory.limit_in_bytes"
  std::string version2;    // "memory.max"
};

// Possible paths of the file: in the process' own group, the groups above it, and the root, which
// is the container's own group where a process sees no other. Not all of them exist.
//   root  of /proc and /sys; "" but in tests
std::vector<std::string> PathsInGroups(const std::string& root, const GroupFile& file);

}  // namespace liquidblend::base

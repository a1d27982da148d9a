// The control groups (cgroups) of this process, where the kernel keeps its limits.
#pragma once

#include <string>
#include <vector>

namespace liquidblend::base {

// A file of limits as each version of control groups calls it.
struct GroupFile {
  std::string controller;  // of version 1: "memory"
  std::string version1;    // "memory.limit_in_bytes"
  std::string version2;    // "memory.max"
};

// Where that file may be: of the process' own group, those above it, and the root, which is the
// container's own where a process sees nothing else. Not all of them exist.
//   root  of /proc and /sys; "" but in tests
std::vector<std::string> PathsInGroups(const std::string& root, const GroupFile& file);

}  // namespace liquidblend::base

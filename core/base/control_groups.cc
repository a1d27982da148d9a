#include "core/base/control_groups.h"

#include <cstddef>
#include <fstream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::base {
namespace {

// `group` begins with a slash.
void AddGroupAndThoseAbove(const std::string& hierarchy, std::string group, const std::string& name,
                           std::vector<std::string>& paths) {
  paths.push_back(absl::StrCat(hierarchy, "/", name));
  while (group.size() > 1) {
    paths.push_back(absl::StrCat(hierarchy, group, "/", name));
    group.resize(group.rfind('/'));
  }
}

// Whether a line of version 1 has the controller: "9:cpu,cpuacct" has cpu.
bool IsOf(const std::string& controller, const std::string& hierarchy) {
  const std::string names = hierarchy.substr(hierarchy.find(':') + 1);
  return absl::StrContains(absl::StrCat(",", names, ","), absl::StrCat(",", controller, ","));
}

}  // namespace

// Lines of /proc/self/cgroup are "0::/group" (version 2) and "7:cpu,memory:/group" (version 1).
std::vector<std::string> PathsInGroups(const std::string& root, const GroupFile& file) {
  const std::string hierarchies = absl::StrCat(root, "/sys/fs/cgroup");
  std::vector<std::string> paths;
  std::ifstream groups(absl::StrCat(root, "/proc/self/cgroup"));
  for (std::string line; std::getline(groups, line);) {
    const size_t slash = line.find(":/");
    if (slash == std::string::npos) continue;
    const std::string group = line.substr(slash + 1);
    if (absl::StartsWith(line, "0::")) {
      AddGroupAndThoseAbove(hierarchies, group, file.version2, paths);
    } else if (IsOf(file.controller, line.substr(0, slash))) {
      AddGroupAndThoseAbove(absl::StrCat(hierarchies, "/", file.controller), group, file.version1,
                            paths);
    }
  }
  return paths;
}

}  // namespace liquidblend::base

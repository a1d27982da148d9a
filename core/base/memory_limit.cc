#include "core/base/memory_limit.h"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/control_groups.h"

namespace liquidblend::base {
namespace {

constexpr int64_t kNoLimit = std::numeric_limits<int64_t>::max();

// The limit in a file that holds one number. Other text, such as "max", means no limit.
int64_t LimitIn(const std::string& path) {
  std::string text;
  int64_t limit = 0;
  std::getline(std::ifstream(path), text);
  return absl::SimpleAtoi(text, &limit) && limit > 0 ? limit : kNoLimit;
}

int64_t LimitOfGroups(const std::string& root) {
  int64_t limit = kNoLimit;
  for (const std::string& path :
       PathsInGroups(root, {"memory", "memory.limit_in_bytes", "memory.max"})) {
    limit = std::min(limit, LimitIn(path));
  }
  return limit;
}

int64_t MachineMemory(const std::string& root) {
  std::ifstream info(absl::StrCat(root, "/proc/meminfo"));
  for (std::string line; std::getline(info, line);) {
    std::istringstream words(line);
    std::string name;
    int64_t kibibytes = 0;
    if (words >> name >> kibibytes && name == "MemTotal:" && kibibytes > 0) return kibibytes << 10;
  }
  return kNoLimit;
}

}  // namespace

int64_t MemoryLimit() { return MemoryLimitUnder(""); }

int64_t MemoryForJobs() { return MemoryLimit() / 5 * 4; }

int64_t MemoryLimitUnder(const std::string& root) {
  const int64_t limit = std::min(MachineMemory(root), LimitOfGroups(root));
  return limit == kNoLimit ? 0 : limit;
}

std::string FormatGibibytes(int64_t bytes) {
  const double value = static_cast<double>(bytes);
  if (bytes >= int64_t{1} << 30) return absl::StrFormat("%.1f GiB", value / (1 << 30));
  if (bytes >= int64_t{1} << 20) return absl::StrFormat("%.0f MiB", value / (1 << 20));
  return absl::StrCat(bytes, " bytes");
}

std::string FormatSize(int64_t bytes) {
  constexpr const char* kUnits[] = {"", "KiB", "MiB", "GiB", "TiB"};
  size_t unit = 0;
  while (bytes != 0 && bytes % 1024 == 0 && unit + 1 < std::size(kUnits)) {
    bytes /= 1024;
    ++unit;
  }
  return absl::StrCat(bytes, kUnits[unit]);
}

}  // namespace liquidblend::base

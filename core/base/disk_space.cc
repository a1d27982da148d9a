#include "core/base/disk_space.h"

#include <sys/statvfs.h>

#include <cerrno>

#include "absl/strings/str_cat.h"

namespace liquidblend::base {

absl::StatusOr<DiskSpace> ReadDiskSpace(const std::string& path) {
  struct statvfs found;
  if (statvfs(path.c_str(), &found) != 0) {
    return absl::ErrnoToStatus(errno, absl::StrCat("the disk of '", path, "'"));
  }
  const auto block = static_cast<int64_t>(found.f_frsize);
  return DiskSpace{.size_bytes = static_cast<int64_t>(found.f_blocks) * block,
                   .free_bytes = static_cast<int64_t>(found.f_bavail) * block};
}

}  // namespace liquidblend::base

// Size and free space of a file system.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"

namespace liquidblend::base {

// Size and free space of a file system, in bytes.
struct DiskSpace {
  int64_t size_bytes = 0;
  int64_t free_bytes = 0;  // that this process may use
};

// Reads the space of the file system that holds `path`.  Errors: those of the system, naming the
// path.
absl::StatusOr<DiskSpace> ReadDiskSpace(const std::string& path);

}  // namespace liquidblend::base

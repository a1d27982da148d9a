// One server at a time works on a data directory.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace liquidblend::server {

// Holds the lock until it is destroyed, or the process ends in whatever way. Threads: one at a
// time.
class DataLock {
 public:
  // Creates the directory if it is missing. Errors: kFailedPrecondition if another server has it,
  // naming that process; kPermissionDenied, kUnavailable with the path.
  static absl::StatusOr<DataLock> Take(const std::string& directory);
  ~DataLock();
  DataLock(DataLock&& other) noexcept;
  DataLock& operator=(DataLock&&) = delete;

 private:
  explicit DataLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace liquidblend::server

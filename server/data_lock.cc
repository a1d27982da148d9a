#include "server/data_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::server {
namespace {

// The process id that the holder wrote into the lock file; for messages.
std::string HolderOf(int fd) {
  std::array<char, 32> text = {};
  const ssize_t size = pread(fd, text.data(), text.size(), 0);
  if (size <= 0) return "unknown";
  return std::string(absl::StripAsciiWhitespace({text.data(), static_cast<size_t>(size)}));
}

}  // namespace

absl::StatusOr<DataLock> DataLock::Take(const std::string& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  const std::string path = absl::StrCat(directory, "/server.lock");
  const int fd = error ? -1 : open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0) {
    return absl::ErrnoToStatus(error ? error.value() : errno,
                               absl::StrCat("cannot open '", path, "'"));
  }
  DataLock lock(fd);
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return absl::ErrnoToStatus(errno, absl::StrCat("lock '", path, "'"));
    return absl::FailedPreconditionError(absl::StrCat("data directory '", directory,
                                                      "' is in use by another liquidblend-server, ",
                                                      "process ", HolderOf(fd)));
  }
  const std::string holder = absl::StrCat(getpid(), "\n");
  if (ftruncate(fd, 0) != 0 || pwrite(fd, holder.data(), holder.size(), 0) < 0) {
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot write '", path, "'"));
  }
  return lock;
}

DataLock::~DataLock() {
  if (fd_ >= 0) close(fd_);
}

DataLock::DataLock(DataLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

}  // namespace liquidblend::server

// The few POSIX calls the store is made of, with errors that name the path.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace liquidblend::base {

// Handle that owns one open file and closes it at its end.
class FileHandle {
 public:
  FileHandle() = default;
  explicit FileHandle(int fd) : fd_(fd) {}
  FileHandle(FileHandle&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileHandle& operator=(FileHandle&& other) noexcept;
  ~FileHandle();

  int fd() const { return fd_; }
  bool is_open() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

// Status of an errno: kNotFound, kPermissionDenied, kResourceExhausted (disk, quota, size limit,
// descriptors or memory used up), kUnavailable otherwise, also for a disk that failed (only
// ReadAt() and ReadAll() return kDataLoss). The message is "<action> <path>: <the system's words>".
absl::Status ErrnoStatus(int error_number, absl::string_view action, const std::string& path);

// Whether this is an ErrnoStatus() of a disk, or of a quota on it, that is full.
bool IsDiskFull(const absl::Status& status);

// Opens a file with O_CLOEXEC and other `flags`; `mode` counts when the file is created.
absl::StatusOr<FileHandle> OpenFile(const std::string& path, int flags, int mode = 0644);

// Writes all bytes, however many calls that takes.
absl::Status WriteAll(const FileHandle& file, std::span<const std::byte> bytes,
                      const std::string& path);

// Reads bytes from `offset` on until `into` is full or the file ends; returns how many.
// Errors: kDataLoss if the disk fails.
absl::StatusOr<size_t> ReadAt(const FileHandle& file, size_t offset, std::span<std::byte> into,
                              const std::string& path);

// Hands the first `size` bytes of the file to `take`, chunk by chunk in order.
// Errors: kDataLoss if the file ends early or the disk fails.
absl::Status ReadAll(const FileHandle& file, size_t size, const std::string& path,
                     absl::FunctionRef<void(std::span<const std::byte>)> take);

// The size of a regular file.  Errors: kDataLoss if it is something else.
absl::StatusOr<size_t> SizeOfFile(const FileHandle& file, const std::string& path);

// Whether both files have the same bytes.  Errors: as ReadAt() and SizeOfFile().
absl::StatusOr<bool> HaveSameBytes(const FileHandle& a, const std::string& path_a,
                                   const FileHandle& b, const std::string& path_b);

// Flush a file's content, or a directory's entries, to the disk, so that it survives a loss of
// power.
absl::Status Sync(const FileHandle& file, const std::string& path);
absl::Status SyncDirectory(const std::string& path);

// Creates the directory and its parents where they are missing, durably.
absl::Status MakeDirectories(const std::string& path);

}  // namespace liquidblend::base

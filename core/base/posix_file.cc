#include "core/base/posix_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <vector>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::base {
namespace {

constexpr char kFullMark[] = "liquidblend/disk_full";
constexpr size_t kChunkBytes = size_t{1} << 20;

// Makes the call again as long as a signal interrupts it; returns its result.
template <typename Call>
auto Uninterrupted(Call&& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

absl::StatusCode CodeOf(int error_number) {
  switch (error_number) {
    case ENOENT:
      return absl::StatusCode::kNotFound;
    case EACCES:
    case EPERM:
    case EROFS:
      return absl::StatusCode::kPermissionDenied;
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
    case EMFILE:
    case ENFILE:
    case ENOMEM:
      return absl::StatusCode::kResourceExhausted;
    default:  // EIO, too: a write can be repeated, perhaps elsewhere
      return absl::StatusCode::kUnavailable;
  }
}

}  // namespace

FileHandle& FileHandle::operator=(FileHandle&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

FileHandle::~FileHandle() {
  if (fd_ >= 0) close(fd_);
}

absl::Status ErrnoStatus(int error_number, absl::string_view action, const std::string& path) {
  absl::Status status(
      CodeOf(error_number),
      absl::StrCat(action, " ", path, ": ", std::generic_category().message(error_number)));
  if (error_number == ENOSPC || error_number == EDQUOT) status.SetPayload(kFullMark, absl::Cord());
  return status;
}

bool IsDiskFull(const absl::Status& status) { return status.GetPayload(kFullMark).has_value(); }

absl::StatusOr<FileHandle> OpenFile(const std::string& path, int flags, int mode) {
  const int fd = Uninterrupted([&] { return open(path.c_str(), flags | O_CLOEXEC, mode); });
  if (fd < 0) return ErrnoStatus(errno, "open", path);
  return FileHandle(fd);
}

absl::Status WriteAll(const FileHandle& file, std::span<const std::byte> bytes,
                      const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t written =
        Uninterrupted([&] { return write(file.fd(), bytes.data(), bytes.size()); });
    if (written < 0) return ErrnoStatus(errno, "write", path);
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  return absl::OkStatus();
}

absl::StatusOr<size_t> ReadAt(const FileHandle& file, size_t offset, std::span<std::byte> into,
                              const std::string& path) {
  size_t num_read = 0;
  while (num_read < into.size()) {
    const auto position = static_cast<off_t>(offset + num_read);
    const ssize_t num_more = Uninterrupted(
        [&] { return pread(file.fd(), into.data() + num_read, into.size() - num_read, position); });
    if (num_more < 0 && errno == EIO) {
      return absl::DataLossError(ErrnoStatus(errno, "read", path).message());
    }
    if (num_more < 0) return ErrnoStatus(errno, "read", path);
    if (num_more == 0) break;
    num_read += static_cast<size_t>(num_more);
  }
  return num_read;
}

absl::Status ReadAll(const FileHandle& file, size_t size, const std::string& path,
                     absl::FunctionRef<void(std::span<const std::byte>)> take) {
  std::vector<std::byte> chunk(std::min(size, kChunkBytes));
  for (size_t offset = 0; offset < size;) {
    const auto wanted = std::span(chunk).first(std::min(chunk.size(), size - offset));
    LB_ASSIGN_OR_RETURN(const size_t num_read, ReadAt(file, offset, wanted, path));
    if (num_read < wanted.size()) {
      return absl::DataLossError(
          absl::StrCat("read ", path, ": ends after ", offset + num_read, " of ", size, " bytes"));
    }
    take(wanted);
    offset += num_read;
  }
  return absl::OkStatus();
}

absl::StatusOr<size_t> SizeOfFile(const FileHandle& file, const std::string& path) {
  struct stat info;
  if (fstat(file.fd(), &info) != 0) return ErrnoStatus(errno, "stat", path);
  if (S_ISREG(info.st_mode)) return static_cast<size_t>(info.st_size);
  return absl::DataLossError(absl::StrCat(path, " is not a regular file"));
}

absl::StatusOr<bool> HaveSameBytes(const FileHandle& a, const std::string& path_a,
                                   const FileHandle& b, const std::string& path_b) {
  LB_ASSIGN_OR_RETURN(const size_t size, SizeOfFile(a, path_a));
  LB_ASSIGN_OR_RETURN(const size_t size_b, SizeOfFile(b, path_b));
  if (size != size_b) return false;
  std::vector<std::byte> chunk_a(std::min(size, kChunkBytes)), chunk_b(chunk_a.size());
  for (size_t offset = 0; offset < size; offset += chunk_a.size()) {
    LB_ASSIGN_OR_RETURN(const size_t num_a, ReadAt(a, offset, chunk_a, path_a));
    LB_ASSIGN_OR_RETURN(const size_t num_b, ReadAt(b, offset, chunk_b, path_b));
    if (num_a != num_b || !std::equal(chunk_a.begin(), chunk_a.begin() + num_a, chunk_b.begin())) {
      return false;
    }
  }
  return true;
}

absl::Status Sync(const FileHandle& file, const std::string& path) {
  if (Uninterrupted([&] { return fsync(file.fd()); }) < 0) return ErrnoStatus(errno, "fsync", path);
  return absl::OkStatus();
}

absl::Status SyncDirectory(const std::string& path) {
  LB_ASSIGN_OR_RETURN(const FileHandle directory, OpenFile(path, O_RDONLY | O_DIRECTORY));
  return Sync(directory, path);
}

absl::Status MakeDirectories(const std::string& path) {
  struct stat info;
  if (stat(path.c_str(), &info) == 0) {
    if (S_ISDIR(info.st_mode)) return absl::OkStatus();
    return ErrnoStatus(ENOTDIR, "create directory", path);
  }
  const size_t end = path.find_last_not_of('/');
  const size_t slash = end == std::string::npos ? end : path.rfind('/', end);
  const std::string parent = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  if (parent != path) LB_RETURN_IF_ERROR(MakeDirectories(parent));
  if (mkdir(path.c_str(), 0755) != 0 && errno != EEXIST) {
    return ErrnoStatus(errno, "create directory", path);
  }
  return SyncDirectory(parent);
}

}  // namespace liquidblend::base

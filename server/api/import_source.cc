#include "server/api/import_source.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/glob.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"
#include "server/base/names.h"

namespace liquidblend::server {
namespace {

using base::FileHandle;

constexpr char kLocationField[] = "location";
constexpr int64_t kChunkBytes = 512 << 10;
constexpr size_t kMaxLocationLength = 1024;
constexpr size_t kMaxDepth = 64;

absl::Status AtLocation(absl::StatusCode code, absl::string_view message,
                        absl::string_view reason) {
  const absl::Status status = AtField(kLocationField, absl::Status(code, message));
  return reason.empty() ? status : WithReason(status, reason);
}

absl::Status Cannot(const std::string& shown, int error_number) {
  if (error_number == ENOENT) {
    return AtLocation(absl::StatusCode::kNotFound, absl::StrCat("'", shown, "' does not exist"),
                      "");
  }
  if (error_number == EACCES || error_number == EPERM) {
    return AtLocation(absl::StatusCode::kPermissionDenied,
                      absl::StrCat("the server may not read '", shown, "'"), "");
  }
  return absl::UnavailableError(absl::StrCat("'", shown, "' cannot be read just now"));
}

bool IsRootName(absl::string_view name) {
  return !name.empty() && name != "." && name != ".." && CleanText(name, 255) == name;
}

bool IsFrameFile(absl::string_view name) {
  return absl::EndsWithIgnoreCase(name, ".bobj.gz") || absl::EndsWithIgnoreCase(name, ".ply") ||
         absl::EndsWithIgnoreCase(name, ".obj") || absl::EndsWithIgnoreCase(name, ".stl") ||
         absl::EndsWithIgnoreCase(name, ".vdb");
}

bool IsAnimationFile(absl::string_view name) {
  return IsFrameFile(name) || absl::EndsWith(name, ".uni") || name == "meta.json";
}

// The parts of a location, the root's name first.
absl::StatusOr<std::vector<std::string>> PartsOf(const std::string& location) {
  const std::vector<std::string> parts = absl::StrSplit(location, '/');
  const bool is_right = location.size() <= kMaxLocationLength && parts.size() <= kMaxDepth &&
                        std::all_of(parts.begin(), parts.end(), IsRootName);
  if (is_right) return parts;
  return InvalidField(kLocationField,
                      absl::StrCat("must look like ROOT/directory/directory, without empty "
                                   "parts, '.' or '..', got '",
                                   CleanText(location, 80), "'"));
}

absl::StatusOr<FileHandle> OpenDirectory(const FileHandle& above, const std::string& name,
                                         const std::string& shown) {
  FileHandle directory(
      openat(above.fd(), name.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (directory.is_open()) return directory;
  if (errno == ENOTDIR || errno == ELOOP) {
    return AtLocation(
        absl::StatusCode::kFailedPrecondition,
        absl::StrCat("'", shown, "' is not a directory (symbolic links are not followed)"),
        "NOT_A_DIRECTORY");
  }
  return Cannot(shown, errno);
}

absl::StatusOr<FileHandle> OpenLocation(const ImportRoots& roots, const std::string& location) {
  LB_ASSIGN_OR_RETURN(const std::vector<std::string> parts, PartsOf(location));
  const auto root = roots.find(parts[0]);
  if (root == roots.end()) {
    return AtLocation(absl::StatusCode::kNotFound,
                      absl::StrCat("the server has no import root '", parts[0], "'"),
                      "IMPORT_ROOT_UNKNOWN");
  }
  FileHandle directory(open(root->second.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!directory.is_open()) return Cannot(parts[0], errno);
  std::string shown = parts[0];
  for (size_t k = 1; k < parts.size(); ++k) {
    absl::StrAppend(&shown, "/", parts[k]);
    LB_ASSIGN_OR_RETURN(directory, OpenDirectory(directory, parts[k], shown));
  }
  return directory;
}

// Sorted; no more than `max_files` + 1, which is too many.
absl::StatusOr<std::vector<std::string>> AnimationFilesIn(const FileHandle& directory,
                                                          const std::string& location,
                                                          int max_files,
                                                          const std::string& pattern) {
  const int copy = fcntl(directory.fd(), F_DUPFD_CLOEXEC, 0);
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(fdopendir(copy), closedir);
  if (entries == nullptr) {
    const int error_number = errno;
    if (copy >= 0) close(copy);
    return Cannot(location, error_number);
  }
  std::vector<std::string> names;
  while (const dirent* entry = readdir(entries.get())) {
    if (!IsAnimationFile(entry->d_name)) continue;
    const bool is_chosen =
        pattern.empty() || !IsFrameFile(entry->d_name) || base::MatchesGlob(pattern, entry->d_name);
    if (!is_chosen) continue;
    names.emplace_back(entry->d_name);
    if (static_cast<int>(names.size()) > max_files) break;
  }
  if (std::none_of(names.begin(), names.end(), IsFrameFile)) {
    return AtLocation(
        absl::StatusCode::kFailedPrecondition,
        absl::StrCat("'", location, "' holds no frames (*.bobj.gz, *.ply, *.obj, *.stl or *.vdb)",
                     pattern.empty() ? "" : absl::StrCat(" called '", CleanText(pattern, 80), "'")),
        "NO_FRAMES");
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

absl::StatusOr<ImportRoots> ParseImportRoots(const std::vector<std::string>& arguments) {
  ImportRoots roots;
  for (const std::string& argument : arguments) {
    const size_t equals = argument.find('=');
    const std::string name = argument.substr(0, equals);
    if (equals == std::string::npos || !IsResourceId(name)) {
      return absl::InvalidArgumentError(
          absl::StrCat("--import-root must be NAME=DIR, NAME like [a-z0-9][a-z0-9_.-]{0,62}, got '",
                       argument, "'"));
    }
    const std::string directory = argument.substr(equals + 1);
    std::error_code error;
    if (!std::filesystem::is_directory(directory, error)) {
      return absl::NotFoundError(
          absl::StrCat("--import-root ", name, ": '", directory, "' is not a directory"));
    }
    if (!roots.emplace(name, directory).second) {
      return absl::InvalidArgumentError(absl::StrCat("--import-root ", name, " is named twice"));
    }
  }
  return roots;
}

absl::StatusOr<ImportSource> ImportSource::Open(const ImportRoots& roots,
                                                const std::string& location, int max_files,
                                                const std::string& pattern) {
  LB_ASSIGN_OR_RETURN(FileHandle directory, OpenLocation(roots, location));
  LB_ASSIGN_OR_RETURN(std::vector<std::string> names,
                      AnimationFilesIn(directory, location, max_files, pattern));
  return ImportSource(location, std::move(directory), std::move(names));
}

absl::StatusOr<bool> ImportSource::Next(v1::UploadAnimationRequest& message) {
  if (bytes_left_ > 0) {
    LB_RETURN_IF_ERROR(ReadChunk(*message.mutable_chunk()));
    return true;
  }
  if (num_opened_ == names_.size()) return false;
  const std::string& name = names_[num_opened_++];
  LB_RETURN_IF_ERROR(OpenFile(name));
  message.mutable_file()->set_name(name);
  message.mutable_file()->set_size_bytes(bytes_left_);
  return true;
}

// Opening a named pipe would wait for someone to write into it, but for O_NONBLOCK.
absl::Status ImportSource::OpenFile(const std::string& name) {
  const std::string shown = absl::StrCat(location_, "/", CleanText(name, 80));
  file_ = FileHandle(openat(directory_.fd(), name.c_str(),
                            O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  const int error_number = errno;
  const bool is_odd = !file_.is_open() && (error_number == ELOOP || error_number == ENXIO);
  if (!file_.is_open() && !is_odd) return Cannot(shown, error_number);
  struct stat info = {};
  if (is_odd || fstat(file_.fd(), &info) != 0 || !S_ISREG(info.st_mode)) {
    return AtLocation(
        absl::StatusCode::kFailedPrecondition,
        absl::StrCat("'", shown, "' is not a regular file (symbolic links are not followed)"),
        "NOT_A_FILE");
  }
  bytes_left_ = info.st_size;
  return absl::OkStatus();
}

absl::Status ImportSource::ReadChunk(std::string& chunk) {
  chunk.resize(static_cast<size_t>(std::min(bytes_left_, kChunkBytes)));
  ssize_t num_read = 0;
  do {
    num_read = read(file_.fd(), chunk.data(), chunk.size());
  } while (num_read < 0 && errno == EINTR);
  const std::string shown = absl::StrCat(location_, "/", CleanText(names_[num_opened_ - 1], 80));
  if (num_read < 0) return Cannot(shown, errno);
  if (num_read == 0) {
    return AtLocation(absl::StatusCode::kFailedPrecondition,
                      absl::StrCat("'", shown, "' has become shorter while it was read"),
                      "FILE_CHANGED");
  }
  chunk.resize(static_cast<size_t>(num_read));
  bytes_left_ -= num_read;
  return absl::OkStatus();
}

}  // namespace liquidblend::server

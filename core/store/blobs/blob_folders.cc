#include "core/store/blobs/blob_folders.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/log.h"
#include "core/base/random_id.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {
namespace {

constexpr int kNumFolders = 256;
constexpr int kBlobMode = 0444;  // immutable

absl::Status LockFile(const base::FileHandle& file, const std::string& path) {
  int locked = flock(file.fd(), LOCK_EX);
  while (locked != 0 && errno == EINTR) locked = flock(file.fd(), LOCK_EX);
  return locked == 0 ? absl::OkStatus() : base::ErrnoStatus(errno, "lock", path);
}

struct CloseFolder {
  void operator()(DIR* folder) const { closedir(folder); }
};

// The names in a folder, without those that begin with a dot, sorted.
absl::StatusOr<std::vector<std::string>> ListFolder(const std::string& path) {
  const std::unique_ptr<DIR, CloseFolder> folder(opendir(path.c_str()));
  if (folder == nullptr) return base::ErrnoStatus(errno, "list", path);
  std::vector<std::string> names;
  const auto next = [&] {
    errno = 0;
    return readdir(folder.get());
  };
  while (const dirent* entry = next()) {
    if (entry->d_name[0] != '.') names.emplace_back(entry->d_name);
  }
  if (errno != 0) return base::ErrnoStatus(errno, "list", path);
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

std::string BlobFolders::Folder(const BlobId& id) const {
  const std::string path = Path(id);
  return path.substr(0, path.rfind('/'));
}

absl::StatusOr<base::FileHandle> BlobFolders::Lock(const BlobId& id) const {
  const std::string folder = Folder(id);
  LB_ASSIGN_OR_RETURN(base::FileHandle handle, base::OpenFile(folder, O_RDONLY | O_DIRECTORY));
  LB_RETURN_IF_ERROR(LockFile(handle, folder));
  return handle;
}

// An existing folder may be so new that the process that made it has not flushed it yet, so each
// process flushes once.
absl::Status BlobFolders::Prepare(const BlobId& id) {
  const std::string folder = Folder(id);
  {
    const absl::MutexLock lock(&mutex_);
    if (prepared_.contains(folder)) return absl::OkStatus();
  }
  const std::string parent = folder.substr(0, folder.rfind('/'));
  LB_RETURN_IF_ERROR(base::MakeDirectories(parent));
  if (mkdir(folder.c_str(), 0755) != 0 && errno != EEXIST) {
    return base::ErrnoStatus(errno, "create directory", folder);
  }
  if (is_flushed()) LB_RETURN_IF_ERROR(base::SyncDirectory(parent));
  const absl::MutexLock lock(&mutex_);
  prepared_.insert(folder);
  return absl::OkStatus();
}

absl::Status BlobFolders::Flush(const BlobId& id) const {
  return is_flushed() ? base::SyncDirectory(Folder(id)) : absl::OkStatus();
}

absl::StatusOr<std::string> BlobFolders::MoveAside(const BlobId& id) const {
  const std::string quarantine = absl::StrCat(directory_, "/quarantine");
  LB_RETURN_IF_ERROR(base::MakeDirectories(quarantine));
  const std::string path = Path(id);
  std::string aside = absl::StrCat(quarantine, "/", id, "-", base::RandomHex(4));
  if (rename(path.c_str(), aside.c_str()) != 0) return base::ErrnoStatus(errno, "move aside", path);
  LB_RETURN_IF_ERROR(base::SyncDirectory(quarantine));
  LB_RETURN_IF_ERROR(Flush(id));
  return aside;
}

absl::Status BlobFolders::List(const std::string& root, std::vector<BlobInfo>& blobs) const {
  for (int k = 0; k < kNumFolders; ++k) {
    const std::string folder = absl::StrFormat("%s/%s/%02x", directory_, root, k);
    const auto names = ListFolder(folder);
    if (absl::IsNotFound(names.status())) continue;
    if (!names.ok()) return names.status();
    for (const std::string& name : *names) {
      const std::string path = absl::StrCat(folder, "/", name);
      struct stat info;
      if (!CheckBlobId(name).ok() || Path(name) != path) continue;
      if (lstat(path.c_str(), &info) != 0) {
        if (errno == ENOENT) continue;  // deleted meanwhile
        return base::ErrnoStatus(errno, "stat", path);
      }
      blobs.push_back({name, info.st_size, absl::TimeFromTimespec(info.st_mtim)});
    }
  }
  std::ranges::sort(blobs, {}, &BlobInfo::id);
  return absl::OkStatus();
}

absl::StatusOr<TemporaryFile> CreateTemporaryFile(const std::string& folder) {
  while (true) {
    TemporaryFile temporary;
    temporary.path = absl::StrCat(folder, "/", getpid(), "-", base::RandomHex(8));
    auto file = base::OpenFile(temporary.path, O_RDWR | O_CREAT | O_EXCL, kBlobMode);
    if (!file.ok()) return file.status();
    temporary.file = *std::move(file);
    LB_RETURN_IF_ERROR(LockFile(temporary.file, temporary.path));
    // RemoveLeftOvers() of another process may have removed the file between its creation and the
    // lock.
    struct stat info;
    if (fstat(temporary.file.fd(), &info) != 0)
      return base::ErrnoStatus(errno, "stat", temporary.path);
    if (info.st_nlink > 0) return temporary;
  }
}

absl::Status RemoveLeftOvers(const std::string& folder) {
  LB_ASSIGN_OR_RETURN(const std::vector<std::string> names, ListFolder(folder));
  for (const std::string& name : names) {
    const std::string path = absl::StrCat(folder, "/", name);
    auto file = base::OpenFile(path, O_RDONLY | O_NOFOLLOW);
    if (absl::IsNotFound(file.status())) continue;  // just renamed by its writer
    if (!file.ok()) return file.status();
    if (flock(file->fd(), LOCK_EX | LOCK_NB) != 0) continue;
    // The file may have been renamed to its blob between listing and lock; then there is nothing to
    // remove.
    if (unlink(path.c_str()) == 0) {
      base::LogInfo(absl::StrCat("removed ", path, ", which no writer holds"));
    } else if (errno != ENOENT) {
      return base::ErrnoStatus(errno, "remove", path);
    }
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::store

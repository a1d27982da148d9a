// Blobs as files of a local folder (docs/formats.md, "The data directory").
#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/store/blob_store.h"
#include "core/store/content_hash.h"
#include "core/store/fault_point.h"
#include "core/store/posix_file.h"
#include "core/store/random_id.h"

namespace liquidblend::store {
namespace {

constexpr int kNumShards = 256;
constexpr int kBlobMode = 0444;  // immutable

absl::Status LockFile(const FileHandle& file, const std::string& path) {
  int locked = flock(file.fd(), LOCK_EX);
  while (locked != 0 && errno == EINTR) locked = flock(file.fd(), LOCK_EX);
  return locked == 0 ? absl::OkStatus() : ErrnoStatus(errno, "lock", path);
}

// The subfolders of blobs/, by the first two digits of the hash; made when they are first needed.
class Shards {
 public:
  Shards(std::string blobs, Durability durability)
      : blobs_(std::move(blobs)), durability_(durability) {}

  bool is_flushed() const { return durability_ == Durability::kDurable; }

  std::string Folder(const BlobId& id) const { return absl::StrCat(blobs_, "/", id.substr(5, 2)); }
  std::string Path(const BlobId& id) const { return absl::StrCat(Folder(id), "/", id); }

  // Held by whoever makes the blob appear or go; the folder must be there.
  absl::StatusOr<FileHandle> Lock(const BlobId& id) const {
    const std::string folder = Folder(id);
    LB_ASSIGN_OR_RETURN(FileHandle handle, OpenFile(folder, O_RDONLY | O_DIRECTORY));
    LB_RETURN_IF_ERROR(LockFile(handle, folder));
    return handle;
  }

  // Makes the blob's folder, durably. One that is there already may be so new that whoever made it
  // has not flushed it yet, so each handle does that once.
  absl::Status Prepare(const BlobId& id) {
    std::atomic<bool>& durable = durable_[std::stoi(id.substr(5, 2), nullptr, 16)];
    if (durable) return absl::OkStatus();
    const std::string folder = Folder(id);
    if (mkdir(folder.c_str(), 0755) != 0 && errno != EEXIST) {
      return ErrnoStatus(errno, "create directory", folder);
    }
    if (is_flushed()) LB_RETURN_IF_ERROR(SyncDirectory(blobs_));
    durable = true;
    return absl::OkStatus();
  }

 private:
  const std::string blobs_;
  const Durability durability_;
  std::array<std::atomic<bool>, kNumShards> durable_ = {};
};

class MappedBlob : public Blob {
 public:
  MappedBlob(void* start, size_t size) : start_(start), size_(size) {}
  MappedBlob(const MappedBlob&) = delete;
  MappedBlob& operator=(const MappedBlob&) = delete;
  ~MappedBlob() override {
    if (size_ > 0) munmap(start_, size_);
  }
  std::span<const std::byte> bytes() const override {
    return {static_cast<const std::byte*>(start_), size_};
  }

 private:
  void* start_;
  size_t size_;
};

// The names in a folder, without those that begin with a dot, sorted.
absl::StatusOr<std::vector<std::string>> ListFolder(const std::string& path) {
  DIR* const folder = opendir(path.c_str());
  if (folder == nullptr) return ErrnoStatus(errno, "list", path);
  std::vector<std::string> names;
  const auto next = [&] {
    errno = 0;
    return readdir(folder);
  };
  while (const dirent* entry = next()) {
    if (entry->d_name[0] != '.') names.emplace_back(entry->d_name);
  }
  const int error_number = errno;
  closedir(folder);
  if (error_number != 0) return ErrnoStatus(error_number, "list", path);
  std::sort(names.begin(), names.end());
  return names;
}

struct TemporaryFile {
  std::string path;
  FileHandle file;  // locked
};

// A new, empty file that this process holds the lock of.
absl::StatusOr<TemporaryFile> CreateTemporaryFile(const std::string& folder) {
  while (true) {
    TemporaryFile temporary;
    temporary.path = absl::StrCat(folder, "/", getpid(), "-", RandomHex(8));
    auto file = OpenFile(temporary.path, O_RDWR | O_CREAT | O_EXCL, kBlobMode);
    if (!file.ok()) return file.status();
    temporary.file = *std::move(file);
    LB_RETURN_IF_ERROR(LockFile(temporary.file, temporary.path));
    // Someone who cleans up may have come between creation and lock.
    struct stat info;
    if (fstat(temporary.file.fd(), &info) != 0) return ErrnoStatus(errno, "stat", temporary.path);
    if (info.st_nlink > 0) return temporary;
  }
}

// Removes temporary files whose lock nobody holds: their writers are gone.
absl::Status RemoveLeftOvers(const std::string& folder) {
  LB_ASSIGN_OR_RETURN(const std::vector<std::string> names, ListFolder(folder));
  for (const std::string& name : names) {
    const std::string path = absl::StrCat(folder, "/", name);
    auto file = OpenFile(path, O_RDONLY | O_NOFOLLOW);
    if (absl::IsNotFound(file.status())) continue;  // its writer has just renamed it
    if (!file.ok()) return file.status();
    if (flock(file->fd(), LOCK_EX | LOCK_NB) != 0) continue;
    // The name may have gone to its blob between listing and lock; then there is nothing to remove.
    if (unlink(path.c_str()) == 0) {
      base::LogInfo(absl::StrCat("removed ", path, ", which no writer holds"));
    } else if (errno != ENOENT) {
      return ErrnoStatus(errno, "remove", path);
    }
  }
  return absl::OkStatus();
}

class LocalBlobWriter : public BlobWriter {
 public:
  LocalBlobWriter(std::shared_ptr<Shards> shards, TemporaryFile temporary)
      : shards_(std::move(shards)), temporary_(std::move(temporary)) {}

  ~LocalBlobWriter() override {
    if (!committed_) unlink(temporary_.path.c_str());
  }

  absl::Status Append(std::span<const std::byte> bytes) override {
    LB_RETURN_IF_ERROR(status_);
    hasher_.Add(bytes);
    status_ = WriteAll(temporary_.file, bytes, temporary_.path);
    FaultPoint("blob.append");
    return status_;
  }

  absl::StatusOr<BlobId> Commit() override {
    LB_RETURN_IF_ERROR(status_);
    const BlobId id = hasher_.Id();
    const std::string path = shards_->Path(id);
    FaultPoint("blob.before_sync");
    LB_RETURN_IF_ERROR(shards_->Prepare(id));
    if (shards_->is_flushed()) LB_RETURN_IF_ERROR(Sync(temporary_.file, temporary_.path));
    FaultPoint("blob.before_rename");
    LB_RETURN_IF_ERROR(Show(id, path));
    committed_ = true;
    status_ = absl::FailedPreconditionError(absl::StrCat("blob ", id, " is committed already"));
    FaultPoint("blob.after_rename");
    if (shards_->is_flushed()) LB_RETURN_IF_ERROR(SyncDirectory(shards_->Folder(id)));
    FaultPoint("blob.committed");
    return id;
  }

 private:
  // Its age begins now, however long ago the bytes came, and nobody deletes what was there before
  // between that and the rename (DeleteIfNotNewer).
  absl::Status Show(const BlobId& id, const std::string& path) {
    LB_ASSIGN_OR_RETURN(const FileHandle lock, shards_->Lock(id));
    if (futimens(temporary_.file.fd(), nullptr) != 0) {
      return ErrnoStatus(errno, "renew the time of", temporary_.path);
    }
    if (rename(temporary_.path.c_str(), path.c_str()) == 0) return absl::OkStatus();
    return ErrnoStatus(errno, "rename to", path);
  }

  std::shared_ptr<Shards> shards_;
  TemporaryFile temporary_;
  BlobHasher hasher_;
  absl::Status status_;  // the first error; committed: what a further call gets
  bool committed_ = false;
};

class LocalBlobStore : public BlobStore {
 public:
  LocalBlobStore(const std::string& directory, Durability durability)
      : blobs_(absl::StrCat(directory, "/blobs")),
        tmp_(absl::StrCat(directory, "/tmp")),
        quarantine_(absl::StrCat(directory, "/quarantine")),
        shards_(std::make_shared<Shards>(blobs_, durability)) {}

  absl::Status Prepare() {
    LB_RETURN_IF_ERROR(MakeDirectories(blobs_));
    LB_RETURN_IF_ERROR(MakeDirectories(tmp_));
    return RemoveLeftOvers(tmp_);
  }

  absl::StatusOr<std::unique_ptr<BlobWriter>> Create() override {
    LB_ASSIGN_OR_RETURN(TemporaryFile temporary, CreateTemporaryFile(tmp_));
    return std::make_unique<LocalBlobWriter>(shards_, std::move(temporary));
  }

  absl::StatusOr<std::shared_ptr<const Blob>> Open(const BlobId& id) override {
    LB_ASSIGN_OR_RETURN(const std::string path, PathOf(id));
    LB_ASSIGN_OR_RETURN(const FileHandle file, OpenFile(path, O_RDONLY | O_NOFOLLOW));
    struct stat info;
    if (fstat(file.fd(), &info) != 0) return ErrnoStatus(errno, "stat", path);
    if (!S_ISREG(info.st_mode)) {
      return absl::DataLossError(absl::StrCat("blob ", path, " is not a regular file"));
    }
    const auto size = static_cast<size_t>(info.st_size);
    // Read, not mapped: a bad disk is an error here, but a SIGBUS through a map. The map that
    // follows finds the same pages in memory.
    BlobHasher hasher;
    LB_RETURN_IF_ERROR(ReadAll(file, size, path, [&](auto bytes) { hasher.Add(bytes); }));
    if (hasher.Id() != id) {
      return absl::DataLossError(
          absl::StrCat("blob ", path, " is damaged: its ", size, " bytes hash to ", hasher.Id()));
    }
    if (size == 0) return std::make_shared<MappedBlob>(nullptr, 0);
    void* const start = mmap(nullptr, size, PROT_READ, MAP_SHARED, file.fd(), 0);
    if (start == MAP_FAILED) return ErrnoStatus(errno, "map", path);
    return std::make_shared<MappedBlob>(start, size);
  }

  absl::Status Verify(const BlobId& id) override { return Open(id).status(); }

  absl::Status Delete(const BlobId& id) override {
    LB_ASSIGN_OR_RETURN(const std::string path, PathOf(id));
    if (unlink(path.c_str()) == 0) return SyncFolder(id);
    return errno == ENOENT ? absl::OkStatus() : ErrnoStatus(errno, "remove", path);
  }

  absl::StatusOr<bool> DeleteIfNotNewer(const BlobId& id, absl::Time time) override {
    LB_ASSIGN_OR_RETURN(const std::string path, PathOf(id));
    const absl::StatusOr<FileHandle> lock = shards_->Lock(id);
    if (absl::IsNotFound(lock.status())) return true;
    if (!lock.ok()) return lock.status();
    struct stat info;
    if (lstat(path.c_str(), &info) != 0) {
      if (errno == ENOENT) return true;
      return ErrnoStatus(errno, "stat", path);
    }
    if (absl::TimeFromTimespec(info.st_mtim) > time) return false;
    LB_RETURN_IF_ERROR(Delete(id));
    return true;
  }

  absl::StatusOr<std::string> Quarantine(const BlobId& id) override {
    LB_ASSIGN_OR_RETURN(const std::string path, PathOf(id));
    LB_RETURN_IF_ERROR(MakeDirectories(quarantine_));
    LB_ASSIGN_OR_RETURN(const FileHandle lock, shards_->Lock(id));
    if (Verify(id).ok())
      return absl::FailedPreconditionError(absl::StrCat("blob ", path, " is whole"));
    std::string aside = absl::StrCat(quarantine_, "/", id, "-", RandomHex(4));
    if (rename(path.c_str(), aside.c_str()) != 0) return ErrnoStatus(errno, "move aside", path);
    LB_RETURN_IF_ERROR(SyncDirectory(quarantine_));
    LB_RETURN_IF_ERROR(SyncFolder(id));
    return aside;
  }

  absl::StatusOr<std::vector<BlobInfo>> List() override {
    std::vector<BlobInfo> blobs;
    for (int k = 0; k < kNumShards; ++k) {
      const std::string shard = absl::StrFormat("%s/%02x", blobs_, k);
      const auto names = ListFolder(shard);
      if (absl::IsNotFound(names.status())) continue;
      if (!names.ok()) return names.status();
      for (const std::string& name : *names) {
        const std::string path = absl::StrCat(shard, "/", name);
        struct stat info;
        if (!IsBlobId(name)) continue;
        if (lstat(path.c_str(), &info) != 0) {
          if (errno == ENOENT) continue;  // deleted meanwhile
          return ErrnoStatus(errno, "stat", path);
        }
        blobs.push_back({name, info.st_size, absl::TimeFromTimespec(info.st_mtim)});
      }
    }
    return blobs;
  }

 private:
  absl::Status SyncFolder(const BlobId& id) const {
    return shards_->is_flushed() ? SyncDirectory(shards_->Folder(id)) : absl::OkStatus();
  }

  absl::StatusOr<std::string> PathOf(const BlobId& id) const {
    if (!IsBlobId(id)) return absl::InvalidArgumentError(absl::StrCat("'", id, "' is no blob id"));
    return shards_->Path(id);
  }

  const std::string blobs_;
  const std::string tmp_;
  const std::string quarantine_;
  const std::shared_ptr<Shards> shards_;
};

}  // namespace

std::string LocalBlobPath(const std::string& directory, const BlobId& id) {
  return absl::StrCat(directory, "/blobs/", id.substr(5, 2), "/", id);
}

absl::StatusOr<std::unique_ptr<BlobStore>> OpenLocalBlobStore(const std::string& directory,
                                                              Durability durability) {
  auto blobs = std::make_unique<LocalBlobStore>(directory, durability);
  LB_RETURN_IF_ERROR(blobs->Prepare());
  return blobs;
}

}  // namespace liquidblend::store

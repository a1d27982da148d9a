// Blobs as files of a local folder (docs/formats.md, "The data directory").
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault_point.h"
#include "core/base/log.h"
#include "core/base/posix_file.h"
#include "core/base/random_id.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/blob_folders.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/blobs/content_hash.h"
#include "core/store/blobs/local_blob_store.h"
#include "core/store/blobs/mapped_file.h"
#include "core/store/blobs/new_blob_name.h"

namespace liquidblend::store {
namespace {

// Hashes the file and compares it with the content hash in the id. Errors: kDataLoss if they
// differ.
absl::Status CheckContent(const base::FileHandle& file, const std::string& path, const BlobId& id) {
  LB_ASSIGN_OR_RETURN(const size_t size, base::SizeOfFile(file, path));
  BlobHasher hasher(HashKindOf(id));
  LB_RETURN_IF_ERROR(base::ReadAll(file, size, path, [&](auto bytes) { hasher.Add(bytes); }));
  if (hasher.Id() == ContentIdOf(id)) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("blob ", path, " is damaged: its ", size, " bytes hash to ", hasher.Id()));
}

// Makes a call that needs space on the disk: again each time that the disk is full, as long as
// there may be more room. No room helps against other limits, such as that of open files.
absl::Status CallWithRoom(const RoomMaker& make_room, int64_t num_bytes,
                          absl::FunctionRef<absl::Status()> call) {
  absl::Status status = call();
  while (base::IsDiskFull(status) && make_room && make_room(num_bytes)) status = call();
  return status;
}

class LocalBlobWriter : public BlobWriter {
 public:
  LocalBlobWriter(std::shared_ptr<BlobFolders> folders, RoomMaker make_room,
                  TemporaryFile temporary, NewBlobName name)
      : folders_(std::move(folders)),
        make_room_(std::move(make_room)),
        temporary_(std::move(temporary)),
        name_(std::move(name)),
        hasher_(name_.id.empty() ? HashKind::kSha256 : HashKindOf(name_.id)) {}

  ~LocalBlobWriter() override {
    if (!is_renamed_) unlink(temporary_.path.c_str());
  }

  absl::Status Append(std::span<const std::byte> bytes) override {
    LB_RETURN_IF_ERROR(status_);
    hasher_.Add(bytes);
    status_ = Write(bytes);
    base::FaultPoint("blob.append");
    return status_;
  }

  absl::StatusOr<BlobId> Commit() override {
    LB_RETURN_IF_ERROR(status_);
    LB_ASSIGN_OR_RETURN(const BlobId id, ChooseId());
    base::FaultPoint("blob.before_sync");
    LB_RETURN_IF_ERROR(CallWithRoom(make_room_, 0, [&] { return folders_->Prepare(id); }));
    if (folders_->is_flushed()) LB_RETURN_IF_ERROR(base::Sync(temporary_.file, temporary_.path));
    base::FaultPoint("blob.before_rename");
    LB_RETURN_IF_ERROR(CallWithRoom(make_room_, 0, [&] { return Show(id); }));
    status_ = absl::FailedPreconditionError(absl::StrCat("blob ", id, " is committed already"));
    base::FaultPoint("blob.after_rename");
    LB_RETURN_IF_ERROR(folders_->Flush(id));
    base::FaultPoint("blob.committed");
    return id;
  }

 private:
  // A disk that is full takes a part before it refuses the rest; the file's offset tells how much.
  absl::Status Write(std::span<const std::byte> bytes) {
    const off_t begin = lseek(temporary_.file.fd(), 0, SEEK_CUR);
    if (begin < 0) return base::ErrnoStatus(errno, "seek in", temporary_.path);
    return CallWithRoom(make_room_, static_cast<int64_t>(bytes.size()), [&]() -> absl::Status {
      const off_t now = lseek(temporary_.file.fd(), 0, SEEK_CUR);
      if (now < begin) return base::ErrnoStatus(errno, "seek in", temporary_.path);
      return base::WriteAll(temporary_.file, bytes.subspan(static_cast<size_t>(now - begin)),
                            temporary_.path);
    });
  }

  absl::StatusOr<BlobId> ChooseId() const {
    const BlobId content = hasher_.Id();
    if (name_.is_upload) return absl::StrCat(content, "-", base::RandomHex(16));
    if (name_.id.empty()) return content;
    if (ContentIdOf(name_.id) == content) return name_.id;
    return absl::DataLossError(absl::StrCat("the bytes for blob ", name_.id, " hash to ", content));
  }

  // Makes the blob visible. Its age begins now, however long ago its bytes were written. The lock
  // keeps DeleteIfNotNewer() from deleting an existing blob between the comparison and the rename.
  absl::Status Show(const BlobId& id) {
    const std::string path = folders_->Path(id);
    LB_ASSIGN_OR_RETURN(const base::FileHandle lock, folders_->Lock(id));
    if (folders_->is_flushed()) {  // a cache holds copies, which may be replaced
      LB_ASSIGN_OR_RETURN(const bool is_there, KeepExisting(id, path));
      if (is_there) return absl::OkStatus();
    }
    if (futimens(temporary_.file.fd(), nullptr) != 0) {
      return base::ErrnoStatus(errno, "renew the time of", temporary_.path);
    }
    if (rename(temporary_.path.c_str(), path.c_str()) != 0) {
      return base::ErrnoStatus(errno, "rename to", path);
    }
    is_renamed_ = true;
    return absl::OkStatus();
  }

  // Whether the blob exists already; if so, renews its time. A damaged one is moved to quarantine.
  absl::StatusOr<bool> KeepExisting(const BlobId& id, const std::string& path) const {
    const absl::StatusOr<base::FileHandle> file = base::OpenFile(path, O_RDONLY | O_NOFOLLOW);
    if (absl::IsNotFound(file.status())) return false;
    LB_RETURN_IF_ERROR(file.status());
    const absl::StatusOr<bool> is_same =
        base::HaveSameBytes(*file, path, temporary_.file, temporary_.path);
    if (!is_same.ok() && !absl::IsDataLoss(is_same.status())) return is_same.status();
    if (is_same.ok() && *is_same) {
      if (utimensat(AT_FDCWD, path.c_str(), nullptr, 0) == 0) return true;
      return base::ErrnoStatus(errno, "renew the time of", path);
    }
    const absl::Status content = CheckContent(*file, path, id);
    if (content.ok() && !is_same.ok()) {  // the temporary file cannot be read
      return absl::UnavailableError(is_same.status().message());
    }
    if (content.ok()) {
      return absl::AlreadyExistsError(
          absl::StrCat("blob ", path, " has other content with the same hash"));
    }
    if (!absl::IsDataLoss(content)) return content;
    LB_ASSIGN_OR_RETURN(const std::string aside, folders_->MoveAside(id));
    base::LogWarning(absl::StrCat("blob ", path, " was damaged: moved to ", aside));
    return false;
  }

  const std::shared_ptr<BlobFolders> folders_;
  const RoomMaker make_room_;  // may be empty
  TemporaryFile temporary_;
  const NewBlobName name_;
  BlobHasher hasher_;
  absl::Status status_;  // the first error; after Commit(), that of a further call
  bool is_renamed_ = false;
};

class LocalBlobStore : public BlobStore {
 public:
  LocalBlobStore(const std::string& directory, Durability durability, RoomMaker make_room = nullptr)
      : directory_(directory),
        folders_(std::make_shared<BlobFolders>(directory, durability)),
        make_room_(std::move(make_room)) {}

  absl::Status Prepare() {
    LB_RETURN_IF_ERROR(base::MakeDirectories(absl::StrCat(directory_, "/blobs")));
    LB_RETURN_IF_ERROR(base::MakeDirectories(tmp()));
    return RemoveLeftOvers(tmp());
  }

  absl::StatusOr<std::unique_ptr<BlobWriter>> Create() override { return CreateNamed({}); }

  absl::StatusOr<std::unique_ptr<BlobWriter>> CreateAs(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckBlobId(id));
    return CreateNamed({.id = id});
  }

  absl::StatusOr<std::unique_ptr<BlobWriter>> CreateUpload() override {
    return CreateNamed({.id = "", .is_upload = true});
  }

  absl::StatusOr<std::shared_ptr<const Blob>> Open(const BlobId& id) override {
    LB_ASSIGN_OR_RETURN(const std::string path, PathOf(id));
    LB_ASSIGN_OR_RETURN(const base::FileHandle file, base::OpenFile(path, O_RDONLY | O_NOFOLLOW));
    LB_ASSIGN_OR_RETURN(const size_t size, base::SizeOfFile(file, path));
    // The file is read, not mapped, so that a bad disk gives an error here. The map that follows
    // finds the same pages in memory; Blob::Check() fails if one of them could not be read later.
    LB_RETURN_IF_ERROR(CheckContent(file, path, id));
    return MapFile(file, size, path);
  }

  absl::Status Verify(const BlobId& id) override { return Open(id).status(); }

  absl::Status Delete(const BlobId& id) override {
    LB_ASSIGN_OR_RETURN(const std::string path, PathOf(id));
    if (unlink(path.c_str()) == 0) {
      // Not flushed for uploads, as there may be thousands of files. One that comes back after a
      // power cut is collected.
      return IsUploadId(id) ? absl::OkStatus() : folders_->Flush(id);
    }
    return errno == ENOENT ? absl::OkStatus() : base::ErrnoStatus(errno, "remove", path);
  }

  absl::StatusOr<bool> DeleteIfNotNewer(const BlobId& id, absl::Time time) override {
    LB_ASSIGN_OR_RETURN(const std::string path, PathOf(id));
    const absl::StatusOr<base::FileHandle> lock = folders_->Lock(id);
    if (absl::IsNotFound(lock.status())) return true;
    if (!lock.ok()) return lock.status();
    struct stat info;
    if (lstat(path.c_str(), &info) != 0) {
      if (errno == ENOENT) return true;
      return base::ErrnoStatus(errno, "stat", path);
    }
    if (absl::TimeFromTimespec(info.st_mtim) > time) return false;
    LB_RETURN_IF_ERROR(Delete(id));
    return true;
  }

  absl::StatusOr<std::string> Quarantine(const BlobId& id) override {
    LB_ASSIGN_OR_RETURN(const std::string path, PathOf(id));
    LB_RETURN_IF_ERROR(folders_->Prepare(id));
    LB_ASSIGN_OR_RETURN(const base::FileHandle lock, folders_->Lock(id));
    if (Verify(id).ok()) {
      return absl::FailedPreconditionError(absl::StrCat("blob ", path, " is whole"));
    }
    return folders_->MoveAside(id);
  }

  absl::StatusOr<std::vector<BlobInfo>> List() override {
    std::vector<BlobInfo> blobs, uploads;
    LB_RETURN_IF_ERROR(folders_->List("blobs", blobs));
    LB_RETURN_IF_ERROR(folders_->List("uploads", uploads));
    blobs.insert(blobs.end(), uploads.begin(), uploads.end());
    return blobs;
  }

  absl::StatusOr<std::string> ReadCatalogId() override {
    const absl::StatusOr<base::FileHandle> file =
        base::OpenFile(catalog_id_path(), O_RDONLY | O_NOFOLLOW);
    if (absl::IsNotFound(file.status())) return std::string();
    LB_RETURN_IF_ERROR(file.status());
    LB_ASSIGN_OR_RETURN(const size_t size, base::SizeOfFile(*file, catalog_id_path()));
    if (size == 0 || size > size_t{kMaxCatalogIdBytes}) {
      return absl::DataLossError(
          absl::StrCat(catalog_id_path(), " has ", size, " bytes, which is no id"));
    }
    std::string id;
    LB_RETURN_IF_ERROR(base::ReadAll(*file, size, catalog_id_path(), [&](auto bytes) {
      id.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    }));
    return id;
  }

  absl::Status WriteCatalogId(const std::string& id) override {
    LB_ASSIGN_OR_RETURN(const TemporaryFile temporary, CreateTemporaryFile(tmp()));
    LB_RETURN_IF_ERROR(base::WriteAll(
        temporary.file, std::as_bytes(std::span(id.data(), id.size())), temporary.path));
    LB_RETURN_IF_ERROR(base::Sync(temporary.file, temporary.path));
    if (rename(temporary.path.c_str(), catalog_id_path().c_str()) != 0) {
      return base::ErrnoStatus(errno, "rename to", catalog_id_path());
    }
    return base::SyncDirectory(directory_);
  }

 private:
  std::string catalog_id_path() const { return absl::StrCat(directory_, "/catalog-id"); }
  std::string tmp() const { return absl::StrCat(directory_, "/tmp"); }

  absl::StatusOr<std::unique_ptr<BlobWriter>> CreateNamed(NewBlobName name) {
    absl::StatusOr<TemporaryFile> temporary = absl::UnknownError("not created");
    LB_RETURN_IF_ERROR(CallWithRoom(make_room_, 0, [&] {
      temporary = CreateTemporaryFile(tmp());
      return temporary.status();
    }));
    return std::make_unique<LocalBlobWriter>(folders_, make_room_, *std::move(temporary),
                                             std::move(name));
  }

  absl::StatusOr<std::string> PathOf(const BlobId& id) const {
    LB_RETURN_IF_ERROR(CheckBlobId(id));
    return folders_->Path(id);
  }

  const std::string directory_;
  const std::shared_ptr<BlobFolders> folders_;
  const RoomMaker make_room_;  // may be empty
};

absl::StatusOr<std::unique_ptr<BlobStore>> OpenPrepared(std::unique_ptr<LocalBlobStore> blobs) {
  LB_RETURN_IF_ERROR(blobs->Prepare());
  return blobs;
}

}  // namespace

std::string LocalBlobPath(const std::string& directory, const BlobId& id) {
  return absl::StrCat(directory, "/", BlobKey(id));
}

absl::StatusOr<std::unique_ptr<BlobStore>> OpenLocalBlobStore(const std::string& directory,
                                                              Durability durability) {
  return OpenPrepared(std::make_unique<LocalBlobStore>(directory, durability));
}

absl::StatusOr<std::unique_ptr<BlobStore>> OpenCacheBlobStore(const std::string& directory,
                                                              RoomMaker make_room) {
  return OpenPrepared(
      std::make_unique<LocalBlobStore>(directory, Durability::kCache, std::move(make_room)));
}

}  // namespace liquidblend::store

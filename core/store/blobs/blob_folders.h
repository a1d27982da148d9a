// Folders and files of a local blob store.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "core/base/posix_file.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::store {

// The subfolders of blobs/ and uploads/ below a directory, made when they are first needed, and
// quarantine/.  Threads: safe; processes: safe.
class BlobFolders {
 public:
  BlobFolders(std::string directory, Durability durability)
      : directory_(std::move(directory)), durability_(durability) {}

  // Whether changes are flushed to the disk: they are not in a cache.
  bool is_flushed() const { return durability_ == Durability::kDurable; }
  // The path of the blob's file.
  std::string Path(const BlobId& id) const { return LocalBlobPath(directory_, id); }

  // Makes the blob's folder, durably.
  absl::Status Prepare(const BlobId& id);

  // Locks the blob's folder; to be held while the blob is made visible or removed.  Errors:
  // kNotFound if there is no folder yet.
  absl::StatusOr<base::FileHandle> Lock(const BlobId& id) const;

  // Makes changes in the blob's folder durable, unless the store is a cache.
  absl::Status Flush(const BlobId& id) const;

  // Moves the blob to quarantine and returns its path there.  Requires: the caller holds its lock.
  absl::StatusOr<std::string> MoveAside(const BlobId& id) const;

  // Adds the blobs below `root`, "blobs" or "uploads", to the list, which it sorts by id.
  absl::Status List(const std::string& root, std::vector<BlobInfo>& blobs) const;

 private:
  std::string Folder(const BlobId& id) const;

  const std::string directory_;
  const Durability durability_;
  absl::Mutex mutex_;
  std::set<std::string> prepared_ ABSL_GUARDED_BY(mutex_);
};

// A file that is being written; its lock (flock) shows that its writer lives.
struct TemporaryFile {
  std::string path;
  base::FileHandle file;
};

// Creates an empty file of mode 0444 in the folder, locked by this process.
absl::StatusOr<TemporaryFile> CreateTemporaryFile(const std::string& folder);

// Removes temporary files whose lock nobody holds: their writers have died.
absl::Status RemoveLeftOvers(const std::string& folder);

}  // namespace liquidblend::store

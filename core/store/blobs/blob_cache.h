// Cache of a remote store's blobs on the local disk, within a budget.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::store {

// Cache of blobs in a local directory. Threads: safe; processes: safe, several may share a
// directory.
class BlobCache {
 public:
  // Returns the free bytes of the cache's disk.
  using FreeBytes = std::function<absl::StatusOr<int64_t>()>;

  // Opens the cache, and creates the directory if missing.  Requires: max_bytes >= 0.
  //   free_bytes  replaces the system's answer
  static absl::StatusOr<std::unique_ptr<BlobCache>> Open(const std::string& directory,
                                                         int64_t max_bytes,
                                                         FreeBytes free_bytes = nullptr);

  // Opens a cached blob, verified like any local blob. Errors: kNotFound if it is not cached, or
  // its file is damaged, which removes it.
  absl::StatusOr<std::shared_ptr<const Blob>> Find(const BlobId& id);

  // Writers of a blob for the cache, as BlobStore's. When the disk refuses a write for lack of
  // space, they remove the least recently used blobs, but none that was used within the last
  // minute. The cache must outlive them.
  absl::StatusOr<std::unique_ptr<BlobWriter>> Create() { return blobs_->Create(); }
  absl::StatusOr<std::unique_ptr<BlobWriter>> CreateAs(const BlobId& id) {
    return blobs_->CreateAs(id);
  }

  // Removes the least recently used blobs until the rest fits into the budget; but none that was
  // used within the last minute. Open blobs stay readable.
  absl::Status Trim();

  // The same, until `free_bytes` are free on the disk; the space of open blobs becomes free once
  // they are closed. Removes nothing if removing all would not suffice.
  absl::Status MakeRoom(int64_t free_bytes);

  // Deletes a blob from the cache; OK if there is none.
  absl::Status Delete(const BlobId& id) { return blobs_->Delete(id); }

 private:
  BlobCache(std::string directory, int64_t max_bytes, FreeBytes free_bytes)
      : directory_(std::move(directory)),
        max_bytes_(max_bytes),
        free_bytes_(std::move(free_bytes)) {}

  // See RoomMaker.
  bool MakeRoomAfterRefusal(int64_t num_bytes);

  const std::string directory_;
  const int64_t max_bytes_;
  const FreeBytes free_bytes_;
  std::unique_ptr<BlobStore> blobs_;  // not null once it is open
};

}  // namespace liquidblend::store

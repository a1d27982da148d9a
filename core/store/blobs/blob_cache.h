// Blobs of a remote store, kept on the local disk as far as a budget goes.
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

// Threads: safe; processes: safe, several may share a directory.
class BlobCache {
 public:
  // What is free on the disk of a cache.
  using FreeBytes = std::function<absl::StatusOr<int64_t>()>;

  // Creates the directory if missing.  Requires: max_bytes >= 0.
  //   free_bytes  instead of what the system says
  static absl::StatusOr<std::unique_ptr<BlobCache>> Open(const std::string& directory,
                                                         int64_t max_bytes,
                                                         FreeBytes free_bytes = nullptr);

  // Verified like any local blob. kNotFound too if the file is damaged, which removes it.
  absl::StatusOr<std::shared_ptr<const Blob>> Find(const BlobId& id);

  // Of a blob that is to be kept.
  absl::StatusOr<std::unique_ptr<BlobWriter>> Create() { return blobs_->Create(); }
  absl::StatusOr<std::unique_ptr<BlobWriter>> CreateAs(const BlobId& id) {
    return blobs_->CreateAs(id);
  }

  // Removes what was not used for the longest time, until the rest fits into the budget; but
  // nothing that was used within the last minute. Blobs that are open stay readable.
  absl::Status Trim();

  // The same, until so much is free on the disk; of blobs that are open that is so once they are
  // closed. Removes nothing if removing all of those would not do.
  absl::Status MakeRoom(int64_t free_bytes);

  absl::Status Delete(const BlobId& id) { return blobs_->Delete(id); }

 private:
  BlobCache(std::string directory, int64_t max_bytes, FreeBytes free_bytes,
            std::unique_ptr<BlobStore> blobs)
      : directory_(std::move(directory)),
        max_bytes_(max_bytes),
        free_bytes_(std::move(free_bytes)),
        blobs_(std::move(blobs)) {}

  const std::string directory_;
  const int64_t max_bytes_;
  const FreeBytes free_bytes_;
  const std::unique_ptr<BlobStore> blobs_;
};

}  // namespace liquidblend::store

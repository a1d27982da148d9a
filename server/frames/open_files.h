// Open files: stored files that were asked for lately. Opening one reads and checks all of it, so
// the last ones stay open, mapped.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/files/files.h"
#include "server/base/recently_used.h"

namespace liquidblend::server {

using BlobPtr = std::shared_ptr<const store::Blob>;

// Opens the blob of a record.
//   name  of the record, for messages
// Errors: kDataLoss if it is missing or damaged; the store's.
absl::StatusOr<BlobPtr> OpenBlob(store::BlobStore& blobs, const store::BlobId& blob,
                                 const std::string& name);

// Files as they are. Of several calls for one file that is not open, one opens it, and the others
// wait for that.  Threads: safe.
class OpenBlobs {
 public:
  static constexpr size_t kMaxOpen = 16;

  // The store outlives it.
  explicit OpenBlobs(store::BlobStore& blobs) : blobs_(blobs) {}

  // May wait for the store. Errors: OpenBlob()'s.
  absl::StatusOr<BlobPtr> Open(const store::BlobId& blob, const std::string& name);
  // Lets go of all files: what was deleted takes no room on the disk then.
  void Clear() { recent_.Clear(); }

 private:
  store::BlobStore& blobs_;
  RecentlyUsed<BlobPtr> recent_{kMaxOpen};
  absl::Mutex mutex_;
  std::set<store::BlobId> opening_ ABSL_GUARDED_BY(mutex_);
};

using AnimationFramesPtr = std::shared_ptr<const store::AnimationFrames>;

// Files of animations.  Threads: safe.
class OpenAnimations {
 public:
  static constexpr size_t kMaxOpen = 8;

  // The store outlives it.
  explicit OpenAnimations(store::BlobStore& blobs) : blobs_(blobs) {}

  //   name  for messages
  // May wait for the store. Errors: kDataLoss if the blob is missing or damaged; the store's.
  absl::StatusOr<AnimationFramesPtr> Open(const store::BlobId& blob, const std::string& name);
  // Likewise.
  void Clear() { frames_.Clear(); }

 private:
  store::BlobStore& blobs_;
  RecentlyUsed<AnimationFramesPtr> frames_{kMaxOpen};
};

}  // namespace liquidblend::server

// Open animations: files of animations whose frames were asked for lately.
#pragma once

#include <list>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/files/files.h"

namespace liquidblend::server {

using AnimationFramesPtr = std::shared_ptr<const store::AnimationFrames>;

// Opening a file reads and checks all of it, so the last kMaxOpen stay open, mapped.  Threads:
// safe.
class OpenAnimations {
 public:
  static constexpr size_t kMaxOpen = 8;

  // The store outlives it.
  explicit OpenAnimations(store::BlobStore& blobs) : blobs_(blobs) {}

  //   name  for messages
  // May wait for the store. Errors: kDataLoss if the blob is missing or damaged; the store's.
  absl::StatusOr<AnimationFramesPtr> Open(const store::BlobId& blob, const std::string& name);

 private:
  struct Entry {
    store::BlobId blob;
    AnimationFramesPtr frames;
  };
  AnimationFramesPtr Find(const store::BlobId& blob);

  store::BlobStore& blobs_;
  absl::Mutex mutex_;
  std::list<Entry> entries_ ABSL_GUARDED_BY(mutex_);  // the last used first
};

}  // namespace liquidblend::server

// Blobs of a store that an import need not copy once more.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "core/base/steady_cond_var.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::admin {

// Blobs of a store that nobody collects soon.  Threads: safe, but for Refresh().
class YoungBlobs {
 public:
  // The store outlives it.
  explicit YoungBlobs(store::BlobStore& blobs) : blobs_(blobs) {}

  // Adds a blob that was just committed.
  void Add(const store::BlobId& id, int64_t size_bytes);

  // The size of a blob, if it is one of them.
  std::optional<int64_t> SizeOf(const store::BlobId& id) const;

  // Goes by a list and the clock of the store, which is that of collections. Once its lists lag,
  // the blobs that are known stay, and no list is asked for any more.  Errors: the store's.
  absl::Status Refresh();

 private:
  struct Found {
    int64_t size_bytes = 0;
    base::SteadyClock::time_point committed;
  };

  store::BlobStore& blobs_;
  bool are_lists_lagging_ = false;
  mutable absl::Mutex mutex_;
  std::map<store::BlobId, Found> found_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::admin

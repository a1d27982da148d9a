// What the methods work with. Knows no gRPC.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/store/blob_store.h"
#include "core/store/catalog.h"
#include "server/catalog/families.h"
#include "server/rpc/make_frame.h"
#include "server/rpc/work_pool.h"

namespace liquidblend::rpc {

struct Limits {
  int max_upload_files = 20'000;                            // >= 1
  int64_t max_upload_bytes = int64_t{64} << 30;             // >= 1; all files of an upload
  int64_t max_chunk_bytes = int64_t{1} << 20;               // >= 1
  int max_targets = 16;                                     // >= 1; of a family
  int max_correspondences = 10'000;                         // >= 0; per target
  absl::Duration watch_interval = absl::Milliseconds(150);  // > 0; between two looks at a job
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Hands out frame buffers and takes them back, so that their memory is reused.  Threads: safe.
class BufferShelf {
 public:
  std::unique_ptr<FrameBuffers> Take();
  void GiveBack(std::unique_ptr<FrameBuffers> buffers);

 private:
  absl::Mutex mutex_;
  std::vector<std::unique_ptr<FrameBuffers>> buffers_ ABSL_GUARDED_BY(mutex_);
};

// Outlives every call.
struct Backends {
  store::Catalog& catalog;
  store::BlobStore& blobs;
  liquidblend::catalog::Families& families;
  const Limits limits;
  BufferShelf buffers;
  WorkPool io;      // waits for the catalog and the disk
  WorkPool frames;  // computes
};

}  // namespace liquidblend::rpc

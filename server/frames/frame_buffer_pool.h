// Pool of frame buffers that are not in use.
#pragma once

#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "server/frames/make_frame.h"

namespace liquidblend::server {

// Hands out frame buffers and takes them back, so that their memory is reused.  Threads: safe.
class FrameBufferPool {
 public:
  // Takes buffers from the pool, or makes new ones.
  std::unique_ptr<FrameBuffers> Take();
  // Gives buffers back to the pool.
  void GiveBack(std::unique_ptr<FrameBuffers> buffers);

 private:
  absl::Mutex mutex_;
  std::vector<std::unique_ptr<FrameBuffers>> buffers_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::server

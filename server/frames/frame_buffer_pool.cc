#include "server/frames/frame_buffer_pool.h"

#include <utility>

namespace liquidblend::server {

std::unique_ptr<FrameBuffers> FrameBufferPool::Take() {
  absl::MutexLock lock(&mutex_);
  if (buffers_.empty()) return std::make_unique<FrameBuffers>();
  std::unique_ptr<FrameBuffers> buffers = std::move(buffers_.back());
  buffers_.pop_back();
  return buffers;
}

void FrameBufferPool::GiveBack(std::unique_ptr<FrameBuffers> buffers) {
  absl::MutexLock lock(&mutex_);
  buffers_.push_back(std::move(buffers));
}

}  // namespace liquidblend::server

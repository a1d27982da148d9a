// Pool of frames' meshes, so that no memory is allocated once a player has warmed up.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "client/player/frame_mesh.h"

namespace liquidblend::player {

using FramePtr = std::shared_ptr<const FrameMesh>;

// Hands out meshes; a mesh comes back by itself when the last pointer to it is gone, also after the
// pool. A mesh that has to grow grows beyond the largest frame that was seen.  Threads: safe.
class FramePool final : public GrowthPolicy, public std::enable_shared_from_this<FramePool> {
 public:
  explicit FramePool(const Allocator& allocator) : allocator_(allocator) {}
  ~FramePool() override;

  // Takes a mesh to fill, of unknown contents.
  std::shared_ptr<FrameMesh> Take();
  size_t GrowTo(size_t bytes) override;

 private:
  void GiveBack(FrameMesh* mesh);
  void CollectReturned() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Allocator allocator_;
  absl::Mutex mutex_;
  size_t largest_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  std::vector<std::unique_ptr<FrameMesh>> free_ ABSL_GUARDED_BY(mutex_);
  // A list without a lock: who gives a mesh back is a loop that must not wait.
  std::atomic<FrameMesh*> returned_ = nullptr;
};

}  // namespace liquidblend::player

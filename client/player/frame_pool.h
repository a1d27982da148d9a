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

// How much memory a mesh has after it had to grow.
enum class Growth {
  kAhead,     // more than the largest frame that was seen, so that soon none grows any more
  kAsNeeded,  // what its frame needs
};

// Hands out meshes; a mesh comes back by itself when the last pointer to it is gone, also after the
// pool. Threads: safe.
class FramePool final : public GrowthPolicy, public std::enable_shared_from_this<FramePool> {
 public:
  explicit FramePool(const Allocator& allocator, Growth growth = Growth::kAhead)
      : allocator_(allocator), growth_(growth) {}
  ~FramePool() override;

  // Takes a mesh to fill, of unknown contents.
  std::shared_ptr<FrameMesh> Take();
  size_t GrowTo(size_t bytes) override;

 private:
  void GiveBack(FrameMesh* mesh);
  void CollectReturned() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Allocator allocator_;
  const Growth growth_;
  absl::Mutex mutex_;
  size_t largest_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  std::vector<std::unique_ptr<FrameMesh>> free_ ABSL_GUARDED_BY(mutex_);
  // A list without a lock: who gives a mesh back is a loop that must not wait.
  std::atomic<FrameMesh*> returned_ = nullptr;
};

}  // namespace liquidblend::player

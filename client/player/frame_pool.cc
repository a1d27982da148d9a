#include "client/player/frame_pool.h"

#include <algorithm>
#include <utility>

namespace liquidblend::player {
namespace {

constexpr double kSpare = 1.25;  // frames that come may be larger than all that were seen

}  // namespace

std::shared_ptr<FrameMesh> FramePool::Take() {
  std::unique_ptr<FrameMesh> mesh;
  {
    const absl::MutexLock lock(&mutex_);
    CollectReturned();
    // The one with the most memory, so that small ones are not made to grow while there are others.
    const auto largest = std::max_element(
        free_.begin(), free_.end(),
        [](const auto& a, const auto& b) { return a->capacity_bytes() < b->capacity_bytes(); });
    if (largest != free_.end()) {
      mesh = std::move(*largest);
      free_.erase(largest);
    }
  }
  if (mesh == nullptr) mesh = std::make_unique<FrameMesh>(allocator_);
  return {mesh.release(),
          [pool = shared_from_this()](FrameMesh* returned) { pool->GiveBack(returned); }};
}

size_t FramePool::GrowTo(size_t bytes) {
  if (growth_ == Growth::kAsNeeded) return bytes;
  const absl::MutexLock lock(&mutex_);
  if (bytes > largest_bytes_) {
    largest_bytes_ = static_cast<size_t>(kSpare * static_cast<double>(bytes));
  }
  return largest_bytes_;
}

void FramePool::GiveBack(FrameMesh* mesh) {
  mesh->next_returned_ = returned_.load(std::memory_order_relaxed);
  while (!returned_.compare_exchange_weak(mesh->next_returned_, mesh, std::memory_order_release,
                                          std::memory_order_relaxed)) {
  }
}

void FramePool::CollectReturned() {
  FrameMesh* mesh = returned_.exchange(nullptr, std::memory_order_acquire);
  while (mesh != nullptr) {
    free_.emplace_back(mesh);
    mesh = std::exchange(mesh->next_returned_, nullptr);
  }
}

FramePool::~FramePool() {
  const absl::MutexLock lock(&mutex_);
  CollectReturned();
}

}  // namespace liquidblend::player

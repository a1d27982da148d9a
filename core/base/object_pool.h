// Pool of objects that are not in use, so that their memory is reused.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::base {

// Hands out objects and takes them back.  Threads: safe.
template <typename Object>
class ObjectPool {
 public:
  // Takes an object from the pool, or makes a new one.
  std::unique_ptr<Object> Take() {
    const absl::MutexLock lock(&mutex_);
    if (free_.empty()) return std::make_unique<Object>();
    std::unique_ptr<Object> object = std::move(free_.back());
    free_.pop_back();
    return object;
  }

  // Gives an object back to the pool.
  void GiveBack(std::unique_ptr<Object> object) {
    const absl::MutexLock lock(&mutex_);
    free_.push_back(std::move(object));
  }

 private:
  absl::Mutex mutex_;
  std::vector<std::unique_ptr<Object>> free_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::base

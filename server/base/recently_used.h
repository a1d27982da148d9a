// The values that were used last, by their keys.
#pragma once

#include <algorithm>
#include <iterator>
#include <list>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::server {

// Keeps up to `max_size` shared pointers; drops the one that was used longest ago.  Threads: safe.
template <typename Pointer>
class RecentlyUsed {
 public:
  explicit RecentlyUsed(size_t max_size) : max_size_(max_size) {}

  // Null: there is none.
  Pointer Find(const std::string& key) {
    absl::MutexLock lock(&mutex_);
    const auto found = FindEntry(key);
    if (found == entries_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found);
    return found->second;
  }

  // Adds a value, in place of one of the same key.
  void Add(const std::string& key, Pointer value) {
    std::list<Entry> dropped;  // destroyed without the lock
    absl::MutexLock lock(&mutex_);
    const auto found = FindEntry(key);
    if (found != entries_.end()) dropped.splice(dropped.begin(), entries_, found);
    entries_.emplace_front(key, std::move(value));
    if (entries_.size() <= max_size_) return;
    dropped.splice(dropped.begin(), entries_, std::prev(entries_.end()));
  }

  void Clear() {
    std::list<Entry> dropped;
    absl::MutexLock lock(&mutex_);
    dropped.swap(entries_);
  }

 private:
  using Entry = std::pair<std::string, Pointer>;

  typename std::list<Entry>::iterator FindEntry(const std::string& key)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return std::find_if(entries_.begin(), entries_.end(),
                        [&](const Entry& entry) { return entry.first == key; });
  }

  const size_t max_size_;
  absl::Mutex mutex_;
  std::list<Entry> entries_ ABSL_GUARDED_BY(mutex_);  // the last used first
};

}  // namespace liquidblend::server

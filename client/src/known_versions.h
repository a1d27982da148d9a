// The newest version of each family that a client has heard of.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::client {

// Families by their full names.  Threads: safe.
class KnownVersions {
 public:
  void Note(const std::string& family, int64_t version) {
    absl::MutexLock lock(&mutex_);
    int64_t& known = versions_[family];
    known = std::max(known, version);
  }
  // After NOT_FOUND: it was deleted, or the store was restored from a backup.
  void Forget(const std::string& family) {
    absl::MutexLock lock(&mutex_);
    versions_.erase(family);
  }
  int64_t Of(const std::string& family) const {  // 0: not known
    absl::MutexLock lock(&mutex_);
    const auto found = versions_.find(family);
    return found == versions_.end() ? 0 : found->second;
  }

 private:
  mutable absl::Mutex mutex_;
  std::map<std::string, int64_t> versions_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::client

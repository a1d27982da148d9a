// Known versions of families: the newest that a client has got, and checks of requested ones.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::client {

// An error if a server without support of version numbers has given another version.
inline absl::Status CheckVersion(int64_t asked, int64_t got) {
  if (asked == 0 || asked == got) return absl::OkStatus();
  return absl::UnimplementedError(
      absl::StrCat("the server gives version ", got, " instead of ", asked,
                   ": it is too old to find a version by its number here; upgrade it"));
}

// Families by their full names.  Threads: safe.
class KnownVersions {
 public:
  void Note(const std::string& family, int64_t version) {
    absl::MutexLock lock(&mutex_);
    int64_t& known = versions_[family];
    known = std::max(known, version);
  }
  // To be called after NOT_FOUND: the family was deleted, or the store was restored from a backup.
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

// Counts of the bytes of running uploads.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"

namespace liquidblend::server {

// Counts by owner the bytes that running uploads of this server have declared, so that parallel
// uploads share one limit.  Threads: safe.
class UploadTally {
 public:
  // Adds to the owner's bytes and returns their sum. Allocates nothing unless bytes > 0.
  int64_t Add(const std::string& owner, int64_t bytes);

  // The bytes of all owners.  Cost: O(owners with uploads under way)
  int64_t Sum();

  // Adds to the bytes that all uploads have declared and not written yet, and returns their sum.
  int64_t AddUnwritten(int64_t bytes);

  // Adds bytes that may arrive at the object store under this upload id. They count until the
  // promise is ended or expires. False, and nothing is added, if the owner has kMaxPromises
  // already.
  // Requires: all promises have the same duration.
  bool Promise(const std::string& owner, const std::string& id, int64_t bytes,
               absl::Duration duration);
  bool HasPromise(const std::string& owner, const std::string& id);
  void EndPromise(const std::string& owner, const std::string& id);
  static constexpr size_t kMaxPromises = 100'000;

 private:
  struct Count {
    int64_t bytes = 0;                        // promised ones included
    std::map<std::string, int64_t> promised;  // bytes by upload id
    // All promises in the order of their ends, those that have ended early included.
    std::deque<std::pair<base::SteadyClock::time_point, std::string>> ends;
  };
  // The owner's count without expired promises; null if there is none.
  Count* Find(const std::string& owner) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  absl::Mutex mutex_;
  int64_t unwritten_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<std::string, Count> counts_ ABSL_GUARDED_BY(mutex_);  // without empty ones
};

}  // namespace liquidblend::server

// Bytes of uploads that are under way.
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

// Counts by owner what uploads of this server have declared and neither submitted nor given up, so
// that parallel uploads share one limit.  Threads: safe.
class UploadTally {
 public:
  // Adds to the owner's bytes and returns their sum. Allocates nothing unless bytes > 0.
  int64_t Add(const std::string& owner, int64_t bytes);

  // Of all owners.  Cost: O(owners with uploads under way)
  int64_t Sum();

  // Adds to the bytes that all uploads have declared and not written yet, and returns their sum.
  int64_t AddUnwritten(int64_t bytes);

  // Adds bytes that may arrive past the server under this upload id: they count until the promise
  // ends or is over. False, and nothing is added, if the owner has kMaxPromises already.
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
  // The owner's count without promises that are over; null: there is none.
  Count* Find(const std::string& owner) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  absl::Mutex mutex_;
  int64_t unwritten_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<std::string, Count> counts_ ABSL_GUARDED_BY(mutex_);  // without those of nothing
};

}  // namespace liquidblend::server

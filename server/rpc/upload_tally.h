// Bytes of uploads that are under way.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"

namespace liquidblend::rpc {

// Counts by owner what uploads of this server have declared and neither submitted nor given up, so
// that parallel uploads share one limit.  Threads: safe.
class UploadTally {
 public:
  // Adds to the owner's bytes and returns their sum.
  int64_t Add(const std::string& owner, int64_t bytes);

  // The owner's bytes, with those that may arrive past the server under this upload id: they count
  // until the promise is over or an upload names them.
  int64_t Promise(const std::string& owner, const std::string& id, int64_t bytes,
                  absl::Duration duration);
  void EndPromise(const std::string& owner, const std::string& id);

 private:
  struct Promised {
    base::SteadyClock::time_point end;
    int64_t bytes = 0;
  };
  struct Count {
    int64_t bytes = 0;                         // promised ones included
    std::map<std::string, Promised> promised;  // by upload ids
  };
  int64_t AddTo(const std::string& owner, int64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  absl::Mutex mutex_;
  std::map<std::string, Count> counts_ ABSL_GUARDED_BY(mutex_);  // without those of nothing
};

}  // namespace liquidblend::rpc

// Quotas of principals: calls per second, and concurrent calls that last.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/access/principal.h"

namespace liquidblend::server {

// Held while a call that counts against max_streams lasts. It must not outlive its Quotas.
using StreamPermit = std::shared_ptr<void>;

// Threads: safe.
class Quotas {
 public:
  explicit Quotas(std::function<absl::Time()> now = absl::Now) : now_(std::move(now)) {}
  Quotas(const Quotas&) = delete;
  Quotas& operator=(const Quotas&) = delete;

  // Counts one call. As many as a second allows may come at once, then they are spread evenly.
  // Errors: kResourceExhausted (RATE_LIMITED) with google.rpc.RetryInfo: when a call will be
  // accepted.
  absl::Status CountRequest(const Principal& principal);

  // Errors: kResourceExhausted (TOO_MANY_STREAMS) with google.rpc.RetryInfo.
  absl::StatusOr<StreamPermit> TakeStream(const Principal& principal);

  // How often all usages were looked through for idle ones. At most once while their number
  // doubles, and once a minute beside that.
  int64_t num_sweeps() const;

 private:
  class Permit;
  struct Usage {
    double requests_left = 0.0;  // at `time`; grows with requests_per_second up to a second's worth
    absl::Time time = absl::InfinitePast();
    int num_streams = 0;
  };

  void GiveBack(const std::string& key);
  void ForgetIdle(absl::Time now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  static constexpr size_t kManyUsages = 4096;  // fewer are never looked through

  const std::function<absl::Time()> now_;
  mutable absl::Mutex mutex_;
  std::map<std::string, Usage> usages_ ABSL_GUARDED_BY(mutex_);  // by Principal::key
  size_t num_at_next_sweep_ ABSL_GUARDED_BY(mutex_) = kManyUsages;
  absl::Time swept_at_ ABSL_GUARDED_BY(mutex_) = absl::InfiniteFuture();
  int64_t num_sweeps_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace liquidblend::server

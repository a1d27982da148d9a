// When this program could last not use its catalog.
#pragma once

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"

namespace liquidblend::store {

// A time in which this program could not use the catalog, by the clock of leases; empty: none.
struct Outage {
  absl::Time begin = absl::InfiniteFuture();
  absl::Time end = absl::InfinitePast();
};

// Remembers the last outage: calls about leases that failed by transient errors, with pauses of
// some seconds at most between them. Threads: safe.
class OutageWatch {
 public:
  // Takes note of how a call about a lease ended.
  //   begin  when it began; it has ended now
  void Note(base::SteadyClock::time_point begin, const absl::Status& status)
      ABSL_LOCKS_EXCLUDED(mutex_);

  // The last outage, if the clock of leases shows `now`.
  Outage Last(absl::Time now) const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  mutable absl::Mutex mutex_;
  bool has_outage_ ABSL_GUARDED_BY(mutex_) = false;
  base::SteadyClock::time_point begin_ ABSL_GUARDED_BY(mutex_);
  base::SteadyClock::time_point end_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::store

// Counter of jobs that have ended, from the catalog.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "server/metrics/metrics.h"

namespace liquidblend::metrics {

// Counts each job that ends from its first Update() on.  Threads: one at a time.
class JobCounter {
 public:
  // Both outlive it.
  JobCounter(store::Catalog& catalog, Metrics& metrics) : catalog_(catalog), metrics_(metrics) {}

  // Counts the jobs that have ended since the last call. Of more than kMaxJobs only the last ones
  // count.  Errors: those of the catalog; the next call counts then.
  static constexpr int kMaxJobs = 1000;
  absl::Status Update();

 private:
  store::Catalog& catalog_;
  Metrics& metrics_;
  std::optional<absl::Time> last_end_;  // of the jobs that were seen; nothing: no look yet
};

}  // namespace liquidblend::metrics

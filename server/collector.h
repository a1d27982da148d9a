// Periodic garbage collection of the server, and pruning of the history.
#pragma once

#include <thread>

#include "absl/synchronization/notification.h"
#include "absl/time/time.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "server/metrics/metrics.h"

namespace liquidblend::server {

struct CollectorOptions {
  absl::Duration every = absl::Hours(1);               // >= 0; 0: never
  absl::Duration older_than = absl::Hours(24);         // >= 0
  absl::Duration keep_history = absl::Hours(24 * 30);  // >= 0; 0: for ever
  absl::Duration first_after = absl::Minutes(1);       // >= 0; but not later than `every`
};

// A thread that collects, and counts and logs the deletions. Servers that share a store may collect
// at the same time. Threads: one at a time.
class Collector {
 public:
  // The stores and the metrics outlive it.
  Collector(store::Catalog& catalog, store::BlobStore& blobs, metrics::Metrics& metrics,
            const CollectorOptions& options);
  // Waits until the deletion under way is done.
  ~Collector();

 private:
  void Run();
  void CollectOnce();

  store::Catalog& catalog_;
  store::BlobStore& blobs_;
  metrics::Metrics& metrics_;
  const CollectorOptions options_;
  absl::Notification stop_;
  std::thread thread_;
};

}  // namespace liquidblend::server

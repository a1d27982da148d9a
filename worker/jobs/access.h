// Keeps a worker from taking jobs while S3, its disk or the database refuses it.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "worker/jobs/stop_signal.h"

namespace liquidblend::jobs {

struct AccessOptions {
  absl::Duration first_pause = absl::Seconds(1);    // > 0; before a probe; doubles with each ...
  absl::Duration longest_pause = absl::Minutes(1);  // ... up to this; >= first_pause
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Whether the error says that this worker may not do what every job needs: S3 denies it, the disk
// is read-only, the database has taken a right away.
bool IsRefusal(const absl::Status& error);

// `error` as WorkerRecord::refusal: printable and short.
std::string RefusalOf(const absl::Status& error);

// Threads: one.
class Access {
 public:
  // Requires: options.Validate().ok(); the others outlive this.
  Access(store::Catalog& catalog, store::BlobStore& blobs, const StopSignal& stop,
         store::pb::WorkerRecord worker, const AccessOptions& options);

  // Waits until a small blob can be written to the store, read from it and deleted, and the catalog
  // takes the worker's record; or until `stop`. The log says so at the begin and at the end, the
  // worker's record in between. Pauses between probes grow, with jitter; they go on growing over
  // refusals that follow one another without a Granted() in between.
  void AwaitAfter(const absl::Status& refusal);

  // A job ended without being refused.
  void Granted() { num_pauses_ = 0; }

 private:
  bool Pause();
  absl::Status Probe();
  void Record(const absl::Status& refusal);

  store::Catalog& catalog_;
  store::BlobStore& blobs_;
  const StopSignal& stop_;
  store::pb::WorkerRecord worker_;
  const AccessOptions options_;
  int num_pauses_ = 0;
};

}  // namespace liquidblend::jobs

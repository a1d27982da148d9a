// Access of a worker to its stores: it takes no jobs while S3, its disk or the database refuses it.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "worker/jobs/attempt/stop_signal.h"

namespace liquidblend::jobs {

struct AccessOptions {
  absl::Duration first_pause = absl::Seconds(1);    // > 0; before a probe; doubles with each ...
  absl::Duration longest_pause = absl::Minutes(1);  // ... up to this; >= first_pause
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Whether the error denies this worker an access that every job needs: S3 refuses it, the disk is
// read-only, the database has revoked a right.
bool IsRefusal(const absl::Status& error);

// The text of `error` for WorkerRecord::refusal: printable and short.
std::string RefusalOf(const absl::Status& error);

// Threads: one.
class Access {
 public:
  // Requires: options.Validate().ok(); the others outlive this.
  Access(store::Catalog& catalog, store::BlobStore& blobs, const StopSignal& stop,
         store::pb::WorkerRecord worker, const AccessOptions& options);

  // Waits until a small blob can be written to the store, read from it and deleted, and the catalog
  // takes the worker's record; or until `stop`, or an error of the catalog that is not transient,
  // as when its tables are of a newer program: the next lease meets that, too. The log has a line
  // at the begin and at the end, the worker's record shows it meanwhile. Pauses between probes
  // grow, with jitter, and over consecutive refusals without a Granted() in between.
  void AwaitAfter(const absl::Status& refusal);

  // To be called when a job has ended without a refusal: pauses start small again.
  void Granted() { num_pauses_ = 0; }

 private:
  bool Pause();
  absl::Status ProbeBlobs();
  void Record(const absl::Status& refusal);

  store::Catalog& catalog_;
  store::BlobStore& blobs_;
  const StopSignal& stop_;
  store::pb::WorkerRecord worker_;
  const AccessOptions options_;
  int num_pauses_ = 0;
};

}  // namespace liquidblend::jobs

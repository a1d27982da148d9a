// Garbage collection: deletes blobs without a reference (imported files, broken-off uploads, old
// versions of families, deleted data) and old jobs of the history.
#pragma once

#include <cstdint>
#include <functional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::admin {

struct CollectOptions {
  // >= 0; must be longer than any upload, and than a worker's time from writing a result to
  // recording it in the catalog, since younger blobs may get a reference soon.
  absl::Duration older_than = absl::Hours(24);
  absl::Duration keep_history = absl::Hours(24 * 30);  // >= 0; of ended jobs; 0: for ever
  bool dry_run = false;                                // only count
  bool adopt = false;  // the blobs become this catalog's, whatever their mark says
  std::function<bool()> must_stop = {};  // asked before each deletion; empty: never
  absl::Status Validate() const;         // names the first field out of range, and its value
};

struct CollectReport {
  int64_t num_unreferenced = 0;  // blobs, young ones too
  int64_t unreferenced_bytes = 0;
  int64_t num_deleted = 0;  // or that would be, in a dry run
  int64_t deleted_bytes = 0;
  int64_t num_pruned = 0;   // jobs of the history
  int64_t num_uploads = 0;  // abandoned multipart uploads; not counted in a dry run
};

// First checks that the blobs are this catalog's, see CheckMark(). Then deletes the records of jobs
// that ended longer ago than keep_history, by the catalog's clock. Then deletes the blobs that no
// record and no unfinished job refers to and that were last committed longer ago than older_than,
// by the store's own clock. Aborts multipart uploads of the same age; a failure to list them is
// only logged. Any number of collections may run at once, on any machines, beside everything else
// (docs/formats.md, "Collecting garbage", says why). Errors: those of the stores. Threads: safe.
absl::StatusOr<CollectReport> Collect(store::Catalog& catalog, store::BlobStore& blobs,
                                      const CollectOptions& options = {});

}  // namespace liquidblend::admin

// Frees what nothing refers to: uploaded files once they are imported, uploads that were broken
// off, old versions of families, and what was deleted. Forgets jobs that ended long ago.
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
  // >= 0; longer than any upload takes, and than a worker takes from writing a result to telling
  // the catalog of it: blobs that were written since may be about to be referred to.
  absl::Duration older_than = absl::Hours(24);
  absl::Duration keep_history = absl::Hours(24 * 30);  // >= 0; of ended jobs; 0: for ever
  bool dry_run = false;                                // only count
  std::function<bool()> must_stop = {};                // asked before each deletion; empty: never
  absl::Status Validate() const;  // names the first field out of range, and its value
};

struct CollectReport {
  int64_t num_unreferenced = 0;  // blobs, young ones too
  int64_t unreferenced_bytes = 0;
  int64_t num_deleted = 0;  // or that would be, in a dry run
  int64_t deleted_bytes = 0;
  int64_t num_pruned = 0;  // jobs of the history
  int64_t num_uploads = 0;  // in parts, that were begun and left; not counted in a dry run
};

// Deletes the blobs that no record and no unfinished job refers to, and that were last committed
// longer ago than that, by the clock of the store itself; and before, the records of jobs that
// ended longer ago than keep_history, by the catalog's clock. Ends uploads in parts that were begun
// as long ago as deleted blobs; an object store that lists none is only logged. Any number of these
// may run at once, on any machines, beside everything else (docs/formats.md, "Collecting garbage",
// says why). Errors: those of the stores. Threads: safe.
absl::StatusOr<CollectReport> Collect(store::Catalog& catalog, store::BlobStore& blobs,
                                      const CollectOptions& options = {});

}  // namespace liquidblend::admin

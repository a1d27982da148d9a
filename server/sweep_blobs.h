// Frees the disk from what is no longer needed: uploaded files once they are imported, uploads that
// were broken off, old versions of families, and what was deleted.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/blob_store.h"
#include "core/store/catalog.h"

namespace liquidblend::server {

struct SweepReport {
  int64_t num_deleted = 0;
  int64_t num_bytes = 0;
};

// Deletes the blobs that no record and no unfinished job refers to, and that were written before
// now - min_age: younger ones may belong to an upload or a result that is about to be recorded.
// Errors: those of the stores.
absl::StatusOr<SweepReport> SweepBlobs(store::Catalog& catalog, store::BlobStore& blobs,
                                       absl::Time now, absl::Duration min_age);

}  // namespace liquidblend::server

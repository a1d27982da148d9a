// Mark of a blob store: the id of the catalog whose blobs it has. Garbage collection with another
// catalog, such as a new and empty one, would delete them all.
#pragma once

#include "absl/status/status.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::admin {

struct MarkOptions {
  bool may_mark = false;   // the catalog refers to some of the blobs, or there are none
  bool has_old = true;     // some blobs are old enough to be deleted
  bool is_forced = false;  // mark the store in any case
  bool dry_run = false;    // write no mark
};

// Checks that the blobs are this catalog's. A store without a mark gets one if `may_mark`.
// Errors: kFailedPrecondition if the store has another catalog's mark, or if it has none, may get
// none, and has old blobs; those of the stores.  Threads: safe.
absl::Status CheckMark(store::Catalog& catalog, store::BlobStore& blobs,
                       const MarkOptions& options);

}  // namespace liquidblend::admin

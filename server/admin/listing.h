// A list of the blobs of a store, with the time by the clock that wrote their times.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::admin {

struct Listing {
  std::vector<store::BlobInfo> blobs;
  absl::Time now;  // when the list was made, by the store's clock
  absl::Status
      probe_deleted;  // of the blob that the time was taken from; it is garbage if it stays
};

// Lists the blobs. The store's clock need not be ours, so the time is that of a small blob that is
// written first and deleted afterwards.  Errors: those of the store; kUnavailable if its lists do
// not show what was just written.
absl::StatusOr<Listing> ListWithClock(store::BlobStore& blobs);

// The same; nothing if the store's lists do not show what was just written.
absl::StatusOr<std::optional<Listing>> ListWithClockIfCurrent(store::BlobStore& blobs);

}  // namespace liquidblend::admin

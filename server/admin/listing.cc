#include "server/admin/listing.h"

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/random_id.h"
#include "core/base/status_macros.h"

namespace liquidblend::admin {
namespace {

// A listing that lacks what was just written is asked for so many times more, with pauses that
// double.
constexpr int kNumMoreLists = 6;
constexpr absl::Duration kListPause = absl::Milliseconds(100);

// Lists the blobs and takes the time from the probe; nothing if the listing lacks the probe.
absl::StatusOr<std::optional<Listing>> ListWith(store::BlobStore& blobs,
                                                const store::BlobId& probe) {
  Listing listing;
  LB_ASSIGN_OR_RETURN(listing.blobs, blobs.List());
  const auto found = std::find_if(listing.blobs.begin(), listing.blobs.end(),
                                  [&](const store::BlobInfo& blob) { return blob.id == probe; });
  if (found == listing.blobs.end()) return std::optional<Listing>();
  listing.now = found->modified;
  listing.blobs.erase(found);
  return std::optional(std::move(listing));
}

}  // namespace

absl::StatusOr<Listing> ListWithClock(store::BlobStore& blobs) {
  LB_ASSIGN_OR_RETURN(std::optional<Listing> listing, ListWithClockIfCurrent(blobs));
  if (listing.has_value()) return *std::move(listing);
  return absl::UnavailableError("a blob, just written, is not in the list of blobs");
}

absl::StatusOr<std::optional<Listing>> ListWithClockIfCurrent(store::BlobStore& blobs) {
  const std::string text = absl::StrCat("what is the time? ", base::RandomHex(16));
  LB_ASSIGN_OR_RETURN(const store::BlobId probe,
                      store::PutBlob(blobs, std::as_bytes(std::span(text.data(), text.size()))));
  absl::StatusOr<std::optional<Listing>> listing = ListWith(blobs, probe);
  for (int k = 0; k < kNumMoreLists && listing.ok() && !listing->has_value(); ++k) {
    absl::SleepFor(kListPause * (1 << k));
    listing = ListWith(blobs, probe);
  }
  const absl::Status deleted = blobs.Delete(probe);
  if (!listing.ok()) return listing.status();
  if (listing->has_value()) {
    (*listing)->probe_deleted = deleted;
  } else {
    LB_RETURN_IF_ERROR(deleted);
  }
  return listing;
}

}  // namespace liquidblend::admin

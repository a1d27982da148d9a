#include "server/admin/young_blobs.h"

#include "absl/time/time.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "server/admin/listing.h"
#include "server/admin/transfer.h"

namespace liquidblend::admin {

void YoungBlobs::Add(const store::BlobId& id, int64_t size_bytes) {
  const absl::MutexLock lock(&mutex_);
  found_[id] = {size_bytes, base::SteadyClock::now()};
}

std::optional<int64_t> YoungBlobs::SizeOf(const store::BlobId& id) const {
  const absl::MutexLock lock(&mutex_);
  const auto found = found_.find(id);
  if (found == found_.end() || base::Since(found->second.committed) >= kKept) return {};
  return found->second.size_bytes;
}

absl::Status YoungBlobs::Refresh() {
  if (are_lists_lagging_) return absl::OkStatus();
  LB_ASSIGN_OR_RETURN(const std::optional<Listing> present, ListWithClockIfCurrent(blobs_));
  if (!present.has_value()) {
    base::LogWarning("the lists of the store lag: blobs that it has are copied, too");
    are_lists_lagging_ = true;
    return absl::OkStatus();
  }
  const base::SteadyClock::time_point now = base::SteadyClock::now();
  const absl::MutexLock lock(&mutex_);
  found_.clear();
  for (const store::BlobInfo& blob : present->blobs) {
    const absl::Duration age = present->now - blob.modified;
    if (age < kKept) found_[blob.id] = {blob.size_bytes, now - absl::ToChronoNanoseconds(age)};
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::admin

#include "server/admin/collect.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"
#include "server/admin/catalog_mark.h"
#include "server/admin/listing.h"

namespace liquidblend::admin {
namespace {

// Shortest interval at which the references are read again while blobs are being deleted. Of a
// large catalog they take seconds to read; reading them shall take a tenth of the time at most.
constexpr absl::Duration kFreshness = absl::Seconds(1);
constexpr int kFreshnessPerRead = 9;

// Parts that a killed program or a client has left. The right to list them may be missing.
int64_t DropUploads(store::BlobStore& blobs, absl::Time newest) {
  const absl::StatusOr<int64_t> num_dropped = blobs.DropOldUploads(newest);
  if (num_dropped.ok()) return *num_dropped;
  base::LogWarning(
      absl::StrCat("cannot abort old multipart uploads: ", num_dropped.status().ToString()));
  return 0;
}

// The blobs that are referred to, as of a moment ago.
class References {
 public:
  explicit References(store::Catalog& catalog) : catalog_(catalog) {}

  absl::StatusOr<bool> Contain(const store::BlobId& id) {
    if (base::Since(read_at_) >= fresh_for_) LB_RETURN_IF_ERROR(Read());
    return Has(id);
  }

  absl::StatusOr<bool> ContainAnyOf(const std::vector<store::BlobInfo>& blobs) {
    LB_RETURN_IF_ERROR(Read());
    return std::any_of(blobs.begin(), blobs.end(),
                       [&](const store::BlobInfo& blob) { return Has(blob.id); });
  }

 private:
  absl::Status Read() {
    const base::SteadyClock::time_point begin = base::SteadyClock::now();
    LB_ASSIGN_OR_RETURN(ids_, catalog_.ListReferencedBlobs());
    read_at_ = base::SteadyClock::now();
    fresh_for_ = std::max(kFreshness, kFreshnessPerRead * base::Since(begin));
    return absl::OkStatus();
  }

  bool Has(const store::BlobId& id) const {
    return std::binary_search(ids_.begin(), ids_.end(), id);
  }

  store::Catalog& catalog_;
  std::vector<std::string> ids_;
  base::SteadyClock::time_point read_at_;
  absl::Duration fresh_for_ = absl::ZeroDuration();
};

absl::Status CheckBlobsAreOurs(store::Catalog& catalog, store::BlobStore& blobs,
                               const Listing& listing, absl::Time newest, References& references,
                               const CollectOptions& options) {
  MarkOptions mark = {.is_forced = options.adopt, .dry_run = options.dry_run};
  LB_ASSIGN_OR_RETURN(mark.may_mark, references.ContainAnyOf(listing.blobs));
  if (listing.blobs.empty()) mark.may_mark = true;
  mark.has_old = std::any_of(listing.blobs.begin(), listing.blobs.end(),
                             [&](const auto& blob) { return blob.modified <= newest; });
  return CheckMark(catalog, blobs, mark);
}

}  // namespace

absl::Status CollectOptions::Validate() const {
  const auto out_of_range = [](const char* field, absl::Duration value) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, " is out of range: ", absl::FormatDuration(value)));
  };
  if (older_than < absl::ZeroDuration()) return out_of_range("older_than", older_than);
  if (keep_history < absl::ZeroDuration()) return out_of_range("keep_history", keep_history);
  return absl::OkStatus();
}

// In this order: what is referred to since the blobs were listed counts as needed.
absl::StatusOr<CollectReport> Collect(store::Catalog& catalog, store::BlobStore& blobs,
                                      const CollectOptions& options) {
  LB_RETURN_IF_ERROR(options.Validate());
  LB_ASSIGN_OR_RETURN(const Listing listing, ListWithClock(blobs));
  LB_RETURN_IF_ERROR(listing.probe_deleted);
  const absl::Time newest = listing.now - options.older_than;
  References references(catalog);
  LB_RETURN_IF_ERROR(CheckBlobsAreOurs(catalog, blobs, listing, newest, references, options));
  CollectReport report;
  LB_ASSIGN_OR_RETURN(report.num_pruned, catalog.PruneHistory({.keep = options.keep_history,
                                                               .dry_run = options.dry_run,
                                                               .must_stop = options.must_stop}));
  for (const store::BlobInfo& blob : listing.blobs) {
    if (options.must_stop && options.must_stop()) break;
    LB_ASSIGN_OR_RETURN(const bool is_needed, references.Contain(blob.id));
    if (is_needed) continue;
    ++report.num_unreferenced;
    report.unreferenced_bytes += blob.size_bytes;
    if (blob.modified > newest) continue;
    if (!options.dry_run) {
      LB_ASSIGN_OR_RETURN(const bool is_gone, blobs.DeleteIfNotNewer(blob.id, newest));
      if (!is_gone) continue;  // committed again meanwhile
    }
    ++report.num_deleted;
    report.deleted_bytes += blob.size_bytes;
  }
  if (!options.dry_run && !(options.must_stop && options.must_stop())) {
    report.num_uploads = DropUploads(blobs, newest);
  }
  return report;
}

}  // namespace liquidblend::admin

#include "server/sweep_blobs.h"

#include <algorithm>
#include <string>
#include <vector>

#include "core/base/status_macros.h"

namespace liquidblend::server {

absl::StatusOr<SweepReport> SweepBlobs(store::Catalog& catalog, store::BlobStore& blobs,
                                       absl::Time now, absl::Duration min_age) {
  // In this order: what is recorded after the blobs were listed still counts as needed.
  LB_ASSIGN_OR_RETURN(const std::vector<store::BlobInfo> present, blobs.List());
  LB_ASSIGN_OR_RETURN(const std::vector<std::string> needed, catalog.ListReferencedBlobs());
  SweepReport report;
  for (const store::BlobInfo& blob : present) {
    if (blob.modified > now - min_age) continue;
    if (std::binary_search(needed.begin(), needed.end(), blob.id)) continue;
    LB_RETURN_IF_ERROR(blobs.Delete(blob.id));
    ++report.num_deleted;
    report.num_bytes += blob.size_bytes;
  }
  return report;
}

}  // namespace liquidblend::server

#include "core/store/catalog/catalog.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {

absl::Status CatalogOptions::Validate() const {
  LB_RETURN_IF_ERROR(retry.Validate());
  if (busy_timeout < absl::ZeroDuration()) {
    return absl::InvalidArgumentError(
        absl::StrCat("busy_timeout = ", absl::FormatDuration(busy_timeout), ", not >= 0"));
  }
  if (max_connections < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_connections = ", max_connections, ", not >= 1"));
  }
  return absl::OkStatus();
}

absl::Status PruneOptions::Validate() const {
  if (keep >= absl::ZeroDuration()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("keep = ", absl::FormatDuration(keep), ", not >= 0"));
}

}  // namespace liquidblend::store

#include "core/store/catalog.h"

#include "absl/strings/str_cat.h"

namespace liquidblend::store {

absl::Status CatalogOptions::Validate() const {
  if (max_attempts < 1) {
    return absl::InvalidArgumentError(absl::StrCat("max_attempts = ", max_attempts, ", not >= 1"));
  }
  if (busy_timeout < absl::ZeroDuration()) {
    return absl::InvalidArgumentError(
        absl::StrCat("busy_timeout = ", absl::FormatDuration(busy_timeout), ", not >= 0"));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::store

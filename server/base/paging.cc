#include "server/base/paging.h"

#include "absl/strings/str_cat.h"
#include "server/base/errors.h"

namespace liquidblend::server {

absl::Status CheckPageSize(int page_size) {
  if (page_size >= 0) return absl::OkStatus();
  return InvalidField("page_size", absl::StrCat("must not be negative, got ", page_size));
}

absl::Status FromList(const absl::Status& status) {
  return absl::IsInvalidArgument(status) ? AtField("page_token", status) : status;
}

}  // namespace liquidblend::server

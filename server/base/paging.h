// Pages of lists (google.aip.dev/158). Sizes and tokens are the catalog's.
#pragma once

#include <cstddef>

#include "absl/status/status.h"

namespace liquidblend::server {

// Bytes of an answer with operations, unless a single one has more. Libraries of gRPC take 4 MiB
// unless told otherwise.
inline constexpr size_t kMaxOperationsBytes = 4'000'000;

// Errors: kInvalidArgument with a violation of page_size if it is negative.
absl::Status CheckPageSize(int page_size);

// Converts the catalog's error of a list: an invalid argument there can only be the page token.
absl::Status FromList(const absl::Status& status);

}  // namespace liquidblend::server

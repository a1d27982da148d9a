// The query of a URL: "weights=0.5,0.1&time=1.25" -> its fields.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace liquidblend::http {

struct QueryField {
  std::string name;
  std::string value;
};

// "%41" -> "A". Errors: kInvalidArgument, naming the place (a broken escape; bytes other than
// printable ASCII, which no name or value of ours has).
absl::StatusOr<std::string> DecodePercent(std::string_view text);

// In the order of the query, decoded; a plus stays one, for numbers have it. Safe for any bytes.
// Errors: kInvalidArgument, naming the field: as above, without a name, given twice, or more than
// 32 fields.
absl::StatusOr<std::vector<QueryField>> ParseQuery(std::string_view query);

}  // namespace liquidblend::http

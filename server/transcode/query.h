// The query of a URL: "weights=0.5,0.1&time=1.25" -> its fields.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace liquidblend::transcode {

struct QueryField {
  std::string name;
  std::string value;
};

// "%41" -> "A". Errors: kInvalidArgument, naming the place (a broken escape; bytes other than
// printable ASCII).
absl::StatusOr<std::string> DecodePercent(std::string_view text);

// Parses the fields in the order of the query, decoded; a plus stays a plus, as numbers have it.
// Safe for any bytes.
// Errors: kInvalidArgument, naming the field: as above, without a name, given twice, or more than
// 32 fields.
absl::StatusOr<std::vector<QueryField>> ParseQuery(std::string_view query);

}  // namespace liquidblend::transcode

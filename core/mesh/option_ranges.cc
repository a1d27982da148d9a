#include "core/mesh/option_ranges.h"

#include "absl/strings/str_cat.h"

namespace liquidblend::mesh {

absl::Status CheckRange(const char* name, double value, const Range& range) {
  if (range.Holds(value)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(name, " is ", value, ", not in [", range.min, ", ", range.max, "]"));
}

}  // namespace liquidblend::mesh

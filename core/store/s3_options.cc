#include "core/store/s3_options.h"

#include "absl/strings/str_cat.h"

namespace liquidblend::store {

absl::Status S3Options::Validate() const {
  const auto out_of_range = [](const char* name, const auto& value) {
    return absl::InvalidArgumentError(absl::StrCat(name, " is out of range: ", value));
  };
  if (cache_directory.empty()) return absl::InvalidArgumentError("cache_directory is empty");
  if (cache_bytes < 0) return out_of_range("cache_bytes", cache_bytes);
  if (max_attempts < 1) return out_of_range("max_attempts", max_attempts);
  if (first_pause <= absl::ZeroDuration()) {
    return out_of_range("first_pause", absl::FormatDuration(first_pause));
  }
  if (longest_pause < first_pause) {
    return out_of_range("longest_pause", absl::FormatDuration(longest_pause));
  }
  if (part_bytes < int64_t{5} << 20) return out_of_range("part_bytes", part_bytes);
  if (num_parallel < 1 || num_parallel > 64) return out_of_range("num_parallel", num_parallel);
  return absl::OkStatus();
}

}  // namespace liquidblend::store

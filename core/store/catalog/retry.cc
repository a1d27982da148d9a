#include "core/store/catalog/retry.h"

#include "absl/strings/str_cat.h"
#include "core/base/retry.h"

namespace liquidblend::store {
namespace {

constexpr absl::Duration kLongestPause = absl::Minutes(8);

template <typename T>
absl::Status OutOfRange(const char* field, const T& value, const char* range) {
  return absl::InvalidArgumentError(absl::StrCat(field, " = ", value, ", not ", range));
}

}  // namespace

absl::Status RetryOptions::Validate() const {
  if (max_attempts < 1) return OutOfRange("max_attempts", max_attempts, ">= 1");
  if (max_environment_failures < 1) {
    return OutOfRange("max_environment_failures", max_environment_failures, ">= 1");
  }
  if (first_pause < absl::ZeroDuration()) {
    return OutOfRange("first_pause", absl::FormatDuration(first_pause), ">= 0");
  }
  if (longest_pause < first_pause || longest_pause > kLongestPause) {
    return OutOfRange("longest_pause", absl::FormatDuration(longest_pause),
                      "from first_pause to 8 min");
  }
  if (!(jitter >= 0.0 && jitter < 1.0)) return OutOfRange("jitter", jitter, "in [0, 1)");
  return absl::OkStatus();
}

absl::Duration PauseAfter(int num_failures, const RetryOptions& options) {
  const absl::Duration pause =
      base::ExponentialPause(num_failures, options.first_pause, options.longest_pause);
  return options.random ? base::Jittered(pause, options.jitter, options.random())
                        : base::Jittered(pause, options.jitter);
}

}  // namespace liquidblend::store

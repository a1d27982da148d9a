#include "core/store/retry.h"

#include <algorithm>
#include <cassert>
#include <random>

#include "absl/strings/str_cat.h"
#include "core/base/data_limit.h"

namespace liquidblend::store {
namespace {

constexpr absl::Duration kLongestPause = absl::Minutes(8);
constexpr int kMostDoublings = 40;  // beyond any pause

template <typename T>
absl::Status OutOfRange(const char* field, const T& value, const char* range) {
  return absl::InvalidArgumentError(absl::StrCat(field, " = ", value, ", not ", range));
}

double SystemRandom() {
  thread_local std::mt19937 generator(std::random_device{}());
  return std::uniform_real_distribution<double>(0.0, 1.0)(generator);
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

bool IsOfEnvironment(const absl::Status& error) {
  if (base::IsOverMemoryLimit(error)) return false;
  return absl::IsUnavailable(error) || absl::IsResourceExhausted(error) ||
         absl::IsPermissionDenied(error);
}

absl::Duration PauseAfter(int num_failures, const RetryOptions& options) {
  assert(num_failures >= 1);
  absl::Duration pause = options.first_pause;
  const int num_doublings = std::min(num_failures - 1, kMostDoublings);
  for (int k = 0; k < num_doublings && pause < options.longest_pause; ++k) pause *= 2;
  const double random = options.random ? options.random() : SystemRandom();
  return std::min(pause, options.longest_pause) * (1.0 + options.jitter * (2.0 * random - 1.0));
}

}  // namespace liquidblend::store

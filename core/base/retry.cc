#include "core/base/retry.h"

#include <algorithm>
#include <cassert>
#include <random>

#include "core/base/data_limit.h"

namespace liquidblend::base {
namespace {

constexpr int kMostDoublings = 40;  // beyond any pause

}  // namespace

bool IsTransient(const absl::Status& error) {
  if (IsOverMemoryLimit(error)) return false;
  return absl::IsUnavailable(error) || absl::IsResourceExhausted(error) ||
         absl::IsPermissionDenied(error);
}

absl::Duration ExponentialPause(int num_failures, absl::Duration first, absl::Duration longest) {
  assert(num_failures >= 1);
  absl::Duration pause = first;
  const int num_doublings = std::min(num_failures - 1, kMostDoublings);
  for (int k = 0; k < num_doublings && pause < longest; ++k) pause *= 2;
  return std::min(pause, longest);
}

absl::Duration Jittered(absl::Duration pause, double jitter, double random) {
  return pause * (1.0 + jitter * (2.0 * random - 1.0));
}

absl::Duration Jittered(absl::Duration pause, double jitter) {
  thread_local std::mt19937 generator(std::random_device{}());
  return Jittered(pause, jitter, std::uniform_real_distribution<double>(0.0, 1.0)(generator));
}

}  // namespace liquidblend::base

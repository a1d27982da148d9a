// Retries of jobs: number of attempts, and pauses between them.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace liquidblend::store {

// Options of retries.
struct RetryOptions {
  int max_attempts = 3;  // >= 1; a job that fails or loses its worker this often fails for good
  // >= 1; so many transient failures of the environment are not counted as attempts. With the
  // pauses below they last a day.
  int max_environment_failures = 300;
  absl::Duration first_pause = absl::Seconds(1);    // >= 0; doubles with each failure ...
  absl::Duration longest_pause = absl::Minutes(5);  // ... up to this; from first_pause to 8 min
  double jitter = 0.25;  // [0, 1); pauses are longer or shorter by a share of up to this
  // Random numbers in [0, 1) for the jitter, called on any thread; empty: the system's.
  std::function<double()> random;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// The pause after the num_failures-th failure.  Requires: num_failures >= 1; options are valid.
absl::Duration PauseAfter(int num_failures, const RetryOptions& options);

}  // namespace liquidblend::store

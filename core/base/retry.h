// Which failures are worth another attempt, and the pauses before it.
#pragma once

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace liquidblend::base {

// Whether the failure says nothing about what was asked for: a service was away (kUnavailable), a
// disk was full (kResourceExhausted), or S3, a disk or the database refused the program
// (kPermissionDenied). A MemoryLimitError() is not transient: the same job needs as much again.
bool IsTransient(const absl::Status& error);

// Exponential back-off: `first` after the first failure, twice as long after each further one, at
// most `longest`.
//   num_failures  >= 1
absl::Duration ExponentialPause(int num_failures, absl::Duration first, absl::Duration longest);

// A pause that is longer or shorter by a share of at most `jitter`, so that many that failed at
// once do not come back at once.
//   jitter  [0, 1)
//   random  [0, 1)
absl::Duration Jittered(absl::Duration pause, double jitter, double random);

// As above, with a random number of this thread's generator.
absl::Duration Jittered(absl::Duration pause, double jitter);

}  // namespace liquidblend::base

// Transient errors, and exponential back-off between attempts.
#pragma once

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace liquidblend::base {

// Whether an error is transient, so that the same request may succeed later: a service was away
// (kUnavailable), a disk was full (kResourceExhausted), or S3, a disk or the database refused the
// program (kPermissionDenied). A MemoryLimitError() is not transient: the same job needs as much
// again.
bool IsTransient(const absl::Status& error);

// Exponential back-off: `first` after the first failure, twice as long after each further one, at
// most `longest`.
//   num_failures  >= 1
absl::Duration ExponentialPause(int num_failures, absl::Duration first, absl::Duration longest);

// The pause, longer or shorter by a random share of at most `jitter`, so that many callers that
// failed at one time do not retry at one time.
//   jitter  [0, 1)
//   random  [0, 1)
absl::Duration Jittered(absl::Duration pause, double jitter, double random);

// As above, with a random number of this thread's generator.
absl::Duration Jittered(absl::Duration pause, double jitter);

}  // namespace liquidblend::base

// Publication of a job's result while the catalog may be busy or away.
#pragma once

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "worker/jobs/attempt/lease_keeper.h"

namespace liquidblend::jobs {

struct PublishOptions {
  absl::Duration pause = absl::Seconds(1);    // > 0; between two calls, on average
  absl::Duration longest = absl::Minutes(2);  // >= 0; no call begins after this time
};

// Calls `publish` until it succeeds or returns an error other than kUnavailable, as long as the job
// may go on. So a database that is busy, or away for less than the lease, does not cost the
// attempt.
// Errors: keeper.Check()'s; publish's, kUnavailable after options.longest. If a call was carried
// out but its answer was lost, the next one returns kAborted: the job has ended.
absl::Status PublishWhileLeased(const LeaseKeeper& keeper,
                                absl::FunctionRef<absl::Status()> publish,
                                const PublishOptions& options = {});

}  // namespace liquidblend::jobs

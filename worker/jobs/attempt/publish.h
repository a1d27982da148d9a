// Publication of a job's result while the catalog may be busy or away.
#pragma once

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "worker/jobs/attempt/lease_keeper.h"

namespace liquidblend::jobs {

struct PublishOptions {
  // > 0; between two calls, on average; doubles with each failure ...
  absl::Duration first_pause = absl::Seconds(1);
  absl::Duration longest_pause = absl::Seconds(10);  // ... up to this; >= first_pause
  // >= 0; no call begins after this time. As long as jobs that meet an outage are tried again
  // (store::RetryOptions): the result may be the work of hours.
  absl::Duration longest = absl::Hours(24);
};

// Calls `publish` until it succeeds or returns an error that does not pass by itself (kUnavailable
// and kResourceExhausted may), as long as the job may go on. So a database that is busy, away, or
// whose disk is full for hours does not cost the work, even if the lease runs out meanwhile: the
// catalog refuses the result if another worker has the job. A stop of the worker ends this, too.
// Errors: keeper.CheckForPublishing()'s; publish's, those that may pass after options.longest. If a
// call was carried out but its answer was lost, the next one returns kAborted: the job has ended.
absl::Status PublishWhileLeased(const LeaseKeeper& keeper,
                                absl::FunctionRef<absl::Status()> publish,
                                const PublishOptions& options = {});

}  // namespace liquidblend::jobs

// The import of an animation: all its stages in order.
#pragma once

#include "absl/status/status.h"
#include "liquidblend/store/v1/records.pb.h"
#include "worker/jobs/job_context.h"

namespace liquidblend::jobs {

// Uploaded files -> a published animation. Errors: those of the stages and the store, and
// LeaseKeeper::Check()'s.
absl::Status RunImport(const store::v1::ImportJob& job, JobContext& context);

}  // namespace liquidblend::jobs

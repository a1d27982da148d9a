// A child of the registration of a family of several targets: one target, on any worker, beside the
// others. RunRegistration() assembles the results.
#pragma once

#include "absl/status/status.h"
#include "liquidblend/store/v1/records.pb.h"
#include "worker/jobs/job_context.h"

namespace liquidblend::jobs {

// Stored animations -> a target file in the store, and the child's end. Every child builds the
// source's space-time mesh for itself: it has the same bytes everywhere, and is a small share of
// the work. A refinement that leaves the target unchanged builds nothing.
//   child  with its parent, which has the options
// Errors: those of the stages and the store, and LeaseKeeper::Check()'s.
absl::Status RunChild(const store::v1::JobRecord& child, JobContext& context);

}  // namespace liquidblend::jobs

// A part of the registration of a family of several targets: one of them, on any worker, beside the
// others. RunRegistration() puts the results together.
#pragma once

#include "absl/status/status.h"
#include "liquidblend/store/v1/records.pb.h"
#include "worker/jobs/job_context.h"

namespace liquidblend::jobs {

// Stored animations -> a target file in the store, and the part's end. Every part makes the
// source's space-time mesh for itself: it is the same everywhere, and a small share of the work. A
// refinement that leaves the target as it is has nothing to make.
//   part  with its parent, which says what to do
// Errors: those of the stages and the store, and why the job was not to go on (LeaseKeeper::Check).
absl::Status RunPart(const store::v1::JobRecord& part, JobContext& context);

}  // namespace liquidblend::jobs

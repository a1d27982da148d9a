// The registration of a family: all its stages in order. Start reading the worker here.
#pragma once

#include "absl/status/status.h"
#include "liquidblend/store/v1/records.pb.h"
#include "worker/jobs/job_context.h"

namespace liquidblend::jobs {

// Stored animations -> a published family. With several targets, this runs after each has been
// registered by a child of its own (run_child.h), and assembles their results; without children,
// the target is registered here. Both give the same bytes. All targets of a family are of one mesh
// of the source: children that another version of the program did, and that are not, are repeated.
// Errors: those of the stages and the store, and LeaseKeeper::Check()'s; kAborted if children are
// repeated, so that the job has gone back with them.
absl::Status RunRegistration(const store::v1::RegisterJob& job, JobContext& context);

}  // namespace liquidblend::jobs

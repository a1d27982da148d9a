// Runs the stages of a job so that neither what they throw nor what they allocate harms the worker.
#pragma once

#include <cstdint>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"

namespace liquidblend::jobs {

struct JobMemory {
  int64_t estimate_bytes = 0;  // >= 0; of the job; 0: there is none
  int64_t worker_bytes = 0;    // > 0; what the worker may hold
};

// Limit of a job's allocations, beyond what its worker had before: four times the estimate and
// 1 GiB, but no more than the worker may hold; without an estimate, what the worker may hold.
int64_t MemoryAllowance(const JobMemory& memory);

// Runs `work`, and turns what it throws into a status:
//   no threads, files or addresses (std::system_error): kUnavailable, of the environment
//   no memory (std::bad_alloc): base::MemoryLimitError()
//   others: kInternal
// `what` begins the message.
absl::Status Guarded(const std::string& what, absl::FunctionRef<absl::Status()> work);

// The same, with MemoryAllowance() as the limit of what can be allocated while `stages` run (see
// base::ScopedDataLimit). What fails for it is base::MemoryLimitError() with the stage, the
// estimate and the limit.
//   stage  the name of the stage that runs at the moment; called when it has thrown
// Threads: one call at a time in a process.
absl::Status RunWithinMemory(const JobMemory& memory, absl::FunctionRef<std::string()> stage,
                             absl::FunctionRef<absl::Status()> stages);

}  // namespace liquidblend::jobs

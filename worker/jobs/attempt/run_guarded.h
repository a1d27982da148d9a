// Guards around the stages of a job: neither exceptions nor allocations of a stage harm the worker.
#pragma once

#include <cstdint>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace liquidblend::jobs {

struct JobMemory {
  int64_t estimate_bytes = 0;  // >= 0; of the job; 0: no estimate
  int64_t worker_bytes = 0;    // > 0; the worker's limit
  // The last attempt failed close to its limit (WasCloseToLimit()).
  bool was_close = false;
};

// Limit of a job's allocations, beyond those of its worker before: four times the estimate and 1
// GiB, but no more than the worker's limit; without an estimate, the worker's limit.
int64_t MemoryAllowance(const JobMemory& memory);

// Runs `work`, and turns its exceptions into a status:
//   no threads, files or addresses (std::system_error): kUnavailable
//   no memory (std::bad_alloc): base::MemoryLimitError()
//   others: kInternal
// `what` begins the message.
absl::Status Guarded(const std::string& what, absl::FunctionRef<absl::Status()> work);

// The same, with MemoryAllowance() as the limit of what can be allocated while `stages` run (see
// base::ScopedDataLimit). A failure due to the limit is base::MemoryLimitError() with the stage,
// the estimate and the limit. A transient error close to the limit may be a library that is refused
// memory, or a store that is away by chance: its message says so, and if the attempt before failed
// like that, too, it is a failure due to the limit.
//   stage  returns the name of the running stage; called after an exception
// Threads: one call at a time in a process.
absl::Status RunWithinMemory(const JobMemory& memory, absl::FunctionRef<std::string()> stage,
                             absl::FunctionRef<absl::Status()> stages);

// Whether this is the message of a transient error close to the limit.
bool WasCloseToLimit(absl::string_view message);

}  // namespace liquidblend::jobs

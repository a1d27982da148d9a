#include "worker/jobs/attempt/run_guarded.h"

#include <algorithm>
#include <exception>
#include <new>
#include <optional>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/data_limit.h"
#include "core/base/memory.h"
#include "core/base/memory_limit.h"
#include "core/base/retry.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::jobs {
namespace {

// Estimates of memory are rounded up, but they are guesses; and what is mapped is more than what is
// touched.
constexpr int64_t kFactor = 4;
constexpr int64_t kSlackBytes = int64_t{1} << 30;
constexpr char kClose[] = " (close to the memory that the job may allocate)";

std::string DescribeLimit(const JobMemory& memory) {
  const int64_t bytes = MemoryAllowance(memory);
  return bytes == store::kAnyMemory ? "it has no limit on this worker"
                                    : absl::StrCat("the job may allocate ",
                                                   base::FormatGibibytes(bytes), " on this worker");
}

absl::Status OverLimit(const JobMemory& memory, const std::string& stage) {
  const std::string estimate =
      memory.estimate_bytes == 0
          ? "there is no estimate"
          : absl::StrCat("the estimate is ", base::FormatGibibytes(memory.estimate_bytes));
  return base::MemoryLimitError(absl::StrCat("out of memory in stage '", stage,
                                             "': ", DescribeLimit(memory), "; ", estimate));
}

// Small enough to need no memory, if there is none for a message.
absl::Status OutOfMemory(const std::string& what) {
  try {
    return base::MemoryLimitError(absl::StrCat(what, ": out of memory"));
  } catch (const std::bad_alloc&) {
    return absl::Status(absl::StatusCode::kResourceExhausted, "");
  }
}

absl::Status Unexpected(const std::string& what, const std::exception& error) {
  const std::string message = absl::StrCat(what, ": ", error.what());
  return dynamic_cast<const std::system_error*>(&error) != nullptr ? absl::UnavailableError(message)
                                                                   : absl::InternalError(message);
}

}  // namespace

int64_t MemoryAllowance(const JobMemory& memory) {
  if (memory.estimate_bytes == 0) return memory.worker_bytes;
  // Not multiplied, as that might overflow.
  if (memory.estimate_bytes >= memory.worker_bytes / kFactor) return memory.worker_bytes;
  return std::min(kFactor * memory.estimate_bytes + kSlackBytes, memory.worker_bytes);
}

absl::Status Guarded(const std::string& what, absl::FunctionRef<absl::Status()> work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return OutOfMemory(what);
  } catch (const std::exception& error) {
    return Unexpected(what, error);
  }
}

absl::Status RunWithinMemory(const JobMemory& memory, absl::FunctionRef<std::string()> stage,
                             absl::FunctionRef<absl::Status()> stages) {
  base::ReturnFreeMemory();  // of the job before, so that it counts for this one
  std::optional<base::ScopedDataLimit> limit(MemoryAllowance(memory));
  try {
    const absl::Status status = stages();
    // Libraries that are refused memory say so in their own words, as if the disk were full.
    const bool may_be_of_memory = base::IsTransient(status) && !absl::IsPermissionDenied(status);
    if (!may_be_of_memory || !limit->IsNearlyReached()) return status;
    limit.reset();
    if (memory.was_close) return OverLimit(memory, stage());
    return absl::Status(status.code(), absl::StrCat(status.message(), kClose));
  } catch (const std::bad_alloc&) {
    limit.reset();  // the message needs memory, too
    return OverLimit(memory, stage());
  } catch (const std::exception& error) {
    const bool is_over = limit->IsNearlyReached();
    limit.reset();
    if (is_over) return OverLimit(memory, stage());
    return Unexpected(absl::StrCat("unexpected in stage '", stage(), "'"), error);
  }
}

bool WasCloseToLimit(absl::string_view message) { return absl::EndsWith(message, kClose); }

}  // namespace liquidblend::jobs

// Limit of the memory that the process may allocate: an allocation beyond it fails, instead of
// exhausting the machine's memory.
#pragma once

#include <sys/resource.h>

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace liquidblend::base {

// Error of work that needs more memory than its limit. It is kResourceExhausted with a mark by
// which IsOverMemoryLimit() distinguishes it from transient errors such as a full disk.
absl::Status MemoryLimitError(const std::string& message);
// Whether the status is a MemoryLimitError().
bool IsOverMemoryLimit(const absl::Status& status);

// Bytes of private writable memory that the process has mapped now, touched or not: heap and
// stacks. Not files that are mapped for reading, and not addresses that are only reserved. 0 if not
// known.
int64_t DataBytes();

// Bytes of such memory that the process may still map: up to its limit (ScopedDataLimit), and no
// more than MemoryForJobs(). Work that knows its need can be refused early by it.
int64_t DataBytesLeft();

// While this lives, the process may map `bytes` more such memory than it has at the start. What
// goes beyond fails in any thread: operator new throws std::bad_alloc, mmap and pthread_create
// return an error. A lower limit that was set before stays in force.
//
// It is RLIMIT_DATA, which the kernel (4.7 and later) checks when memory is mapped. RLIMIT_AS would
// count mapped blobs and the 64 MiB of addresses that glibc reserves for each thread's heap, too.
// Threads: one instance at a time.
class ScopedDataLimit {
 public:
  // Requires: bytes >= 0.
  explicit ScopedDataLimit(int64_t bytes);
  ~ScopedDataLimit();
  ScopedDataLimit(const ScopedDataLimit&) = delete;
  ScopedDataLimit& operator=(const ScopedDataLimit&) = delete;

  // False if the system did not accept the limit (logged).
  bool is_set() const { return is_set_; }

  // Whether less than 16 MiB are left. Then a failure, such as of starting a thread, is due to the
  // limit.
  bool IsNearlyReached() const;

 private:
  rlimit former_ = {};
  int64_t limit_bytes_ = 0;
  bool is_set_ = false;
};

}  // namespace liquidblend::base

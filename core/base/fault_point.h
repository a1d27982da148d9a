// Fault points: places where a test can kill a process, to show that nothing half-written is ever
// visible.
#pragma once

#include "absl/strings/string_view.h"

namespace liquidblend::base {

// Kills the process with SIGKILL if the environment variable LIQUIDBLEND_FAULT_POINT is `name`, or,
// if that is "name#N", at the N-th call with this name. Otherwise it does nothing.
// tests/e2e/faults/kill_test.cc dies at each of them:
//   blob.append            after bytes of a temporary file were written
//   blob.before_sync       all bytes written, nothing flushed
//   blob.before_rename     flushed, not visible yet
//   blob.after_rename      visible, its directory not flushed yet
//   blob.committed         durable; the caller has not got its id yet
//   blob.before_upload     in the cache of an S3 store alone
//   blob.after_upload      in S3; the caller has not got its id yet
//   catalog.before_commit  a change is complete but not committed
//   catalog.after_commit   committed; the caller does not know yet
//   checkpoint.before_write   a registration's state is about to be written
//   checkpoint.after_write    it is a blob; the catalog does not name it yet
//   checkpoint.before_commit  as catalog.before_commit, but only when a checkpoint is recorded
//   checkpoint.after_commit   as catalog.after_commit, likewise; the one before is not deleted yet
//   publish.before_commit  as catalog.before_commit, but only when a job's result is published
//   publish.after_commit   as catalog.after_commit, likewise
// Threads: safe as long as nobody changes the environment.  Cost: one getenv().
void FaultPoint(absl::string_view name);

}  // namespace liquidblend::base

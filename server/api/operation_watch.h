// Watch of an operation: looks at it again and again for one call.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "google/longrunning/operations.pb.h"
#include "server/base/operation_looks.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

// Whether somebody waits for the answer to a call still.
using IsWanted = std::function<bool()>;

// Every limits.watch_interval, less often while many operations are watched; all watches of one
// operation share a look (operation_looks.h). Its timers are on `steps`, so only looks take a
// thread that waits for the catalog. Owned by a shared_ptr. Threads: one of Next() and AwaitDone()
// at a time, until its `done` has been called.
class OperationWatch : public std::enable_shared_from_this<OperationWatch> {
 public:
  // Called once, on a thread of a pool, or before the call returns. Errors: GetOperation's;
  // kCancelled soon after nobody wants it any more; ShuttingDown().
  using Done = absl::AnyInvocable<void(absl::StatusOr<SeenOperationPtr>)>;

  // The backends outlive it.
  OperationWatch(Backends& backends, const std::string& name, IsWanted is_wanted);

  // The next state that differs from the one given before; the first one at once.
  void Next(Done done);
  // The state when the operation is done, or as it is at the deadline.
  void AwaitDone(absl::Time deadline, Done done);

 private:
  void LookAfter(absl::Duration delay);
  void Look();
  void OnSeen(const absl::StatusOr<SeenOperationPtr>& seen);
  absl::Duration Remaining(const SeenOperation& seen) const;
  void Give(absl::StatusOr<SeenOperationPtr> result);

  Backends& backends_;
  const std::shared_ptr<OperationLook> look_;
  const IsWanted is_wanted_;
  std::optional<absl::Time> deadline_;  // of AwaitDone()
  SeenOperationPtr given_;              // last
  Done done_;
};

// When the answer is due; never, if no timeout is given.
absl::Time DeadlineOf(const google::longrunning::WaitOperationRequest& request);

}  // namespace liquidblend::server

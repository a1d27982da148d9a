// Looks at operations for all who watch them or wait for them: one look answers everybody who asks
// about the same operation.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "google/longrunning/operations.pb.h"
#include "server/rpc/shared_look.h"

namespace liquidblend::rpc {

struct Backends;

struct SeenOperation {
  google::longrunning::Operation operation;
  std::string bytes;  // of it, to tell whether it has changed
};
using SeenOperationPtr = std::shared_ptr<const SeenOperation>;
using OperationLook = SharedLook<SeenOperationPtr>;

// Threads: safe.
class OperationLooks {
 public:
  // `backends` outlives it. It outlives what Of() returns.
  explicit OperationLooks(Backends& backends) : backends_(backends) {}
  OperationLooks(const OperationLooks&) = delete;
  OperationLooks& operator=(const OperationLooks&) = delete;

  // The look at the operation of this name; one for all who hold it at the same time. An answer is
  // given again for limits.watch_interval.
  std::shared_ptr<OperationLook> Of(const std::string& name);

  // How long to wait before the next look: limits.watch_interval, and so much more while many
  // operations are watched that the catalog is asked for kMaxPerInterval an interval.
  absl::Duration Interval() const;
  static constexpr int kMaxPerInterval = 50;

  int num_looks() const;  // operations that somebody watches

 private:
  void Forget(const std::string& name);

  Backends& backends_;
  mutable absl::Mutex mutex_;
  std::map<std::string, std::weak_ptr<OperationLook>> looks_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::rpc

// Looks at operations for all who watch them or wait for them: one look answers everybody who asks
// about the same operation.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "google/longrunning/operations.pb.h"
#include "server/base/shared_look.h"
#include "server/base/work_pool.h"

namespace liquidblend::server {

struct SeenOperation {
  google::longrunning::Operation operation;
  std::string bytes;  // of it, to tell whether it has changed
};
using SeenOperationPtr = std::shared_ptr<const SeenOperation>;
using OperationLook = SharedLook<SeenOperationPtr>;

// Threads: safe.
class OperationLooks {
 public:
  //   lookers, timers  as of SharedLook; both outlive it
  //   interval         > 0; an answer is given again for so long
  // It outlives what Of() returns.
  OperationLooks(WorkPool& lookers, WorkPool& timers, absl::Duration interval)
      : lookers_(lookers), timers_(timers), interval_(interval) {}
  OperationLooks(const OperationLooks&) = delete;
  OperationLooks& operator=(const OperationLooks&) = delete;

  // The look at the operation of this name; one for all who hold it at the same time.
  //   read  reads that operation; the first caller's is used
  using Read = std::function<absl::StatusOr<google::longrunning::Operation>()>;
  std::shared_ptr<OperationLook> Of(const std::string& name, Read read);

  // How long to wait before the next look: the interval, and so much more while many operations are
  // watched that the catalog is asked for kMaxPerInterval an interval.
  absl::Duration Interval() const;
  static constexpr int kMaxPerInterval = 50;

  int num_looks() const;  // operations that somebody watches

 private:
  void Forget(const std::string& name);

  WorkPool& lookers_;
  WorkPool& timers_;
  const absl::Duration interval_;
  mutable absl::Mutex mutex_;
  std::map<std::string, std::weak_ptr<OperationLook>> looks_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::server

// Shared looks at operations: one look at an operation answers all its watchers.
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
#include "server/base/lazy_text.h"
#include "server/base/shared_look.h"
#include "server/base/work_pool.h"

namespace liquidblend::server {

struct SeenOperation {
  google::longrunning::Operation operation;
  std::string bytes;  // of the operation, for comparison
  LazyText text;      // of it, for those who show it as text
};
using SeenOperationPtr = std::shared_ptr<const SeenOperation>;
using OperationLook = SharedLook<SeenOperationPtr>;

// Threads: safe.
class OperationLooks {
 public:
  //   lookers, timers  as of SharedLook; both outlive it
  //   interval         > 0; how long an answer is given again
  // It must outlive the results of Of().
  OperationLooks(WorkPool& lookers, WorkPool& timers, absl::Duration interval)
      : lookers_(lookers), timers_(timers), interval_(interval) {}
  OperationLooks(const OperationLooks&) = delete;
  OperationLooks& operator=(const OperationLooks&) = delete;

  // The look at the operation of this name, shared by all concurrent holders.
  //   read  reads that operation; the first caller's is used
  using Read = std::function<absl::StatusOr<google::longrunning::Operation>()>;
  std::shared_ptr<OperationLook> Of(const std::string& name, Read read);

  // The wait before the next look: the interval, prolonged while many operations are watched, so
  // that the catalog is asked for at most kMaxPerInterval per interval.
  absl::Duration Interval() const;
  static constexpr int kMaxPerInterval = 50;

  int num_looks() const;  // operations that are watched

 private:
  std::shared_ptr<OperationLook> Find(const std::string& name) const;
  void Forget(const std::string& name);

  WorkPool& lookers_;
  WorkPool& timers_;
  const absl::Duration interval_;
  mutable absl::Mutex mutex_;
  std::map<std::string, std::weak_ptr<OperationLook>> looks_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::server

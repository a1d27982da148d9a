// Idle threads of a pool that help with a task of another thread.
#pragma once

#include "absl/functional/function_ref.h"

namespace liquidblend::parallel {

// Threads: safe.
class Helpers {
 public:
  virtual ~Helpers() = default;

  // Number of idle threads; soon out of date.
  virtual int num_idle() const = 0;

  // Calls task(k) once for each k in [0, num_tasks), on this thread and on those that are idle, in
  // the order of k as threads become free, and returns when all are done. Never waits for a thread
  // that has not begun: if none is idle this one does it all. Rethrows an exception of a task at
  // the end.
  virtual void Run(int num_tasks, absl::FunctionRef<void(int)> task) = 0;
};

}  // namespace liquidblend::parallel

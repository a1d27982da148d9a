// Threads of a pool that lend a hand while they have nothing else to do.
#pragma once

#include "absl/functional/function_ref.h"

namespace liquidblend::parallel {

// Threads: safe.
class Helpers {
 public:
  virtual ~Helpers() = default;

  // How many threads have nothing to do; soon out of date.
  virtual int num_idle() const = 0;

  // Calls task(k) once for each k in [0, num_tasks), on this thread and on those that are idle, in
  // the order of k as threads become free, and returns when all are done. Never waits for a thread
  // that has not begun: if none is idle this one does it all.
  // What a task throws is thrown then.
  virtual void Run(int num_tasks, absl::FunctionRef<void(int)> task) = 0;
};

}  // namespace liquidblend::parallel

// Thread pool for the work of calls, so that no gRPC thread ever blocks.
#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"

namespace liquidblend::server {

// The time on the clock of all deadlines, the machine's steady clock.
absl::Duration SteadyNow();

// Runs tasks in the order they were posted, and later ones when their time has come. A task that
// throws is logged and dropped. A task with a waiting caller must catch exceptions itself, see
// Guarded().
// Threads: safe.
class WorkPool {
 public:
  using Task = absl::AnyInvocable<void()>;
  using Clock = std::chrono::steady_clock;
  // Identifies a task that waits for its time.
  using Timer = std::pair<Clock::time_point, int64_t>;

  // Starts num_threads >= 1 threads; at most max_waiting >= 1 posted tasks wait for one of them.
  WorkPool(int num_threads, int max_waiting);
  ~WorkPool();  // Stop()
  WorkPool(const WorkPool&) = delete;
  WorkPool& operator=(const WorkPool&) = delete;

  // Takes on new work. Errors, and the task is dropped: kResourceExhausted if too many wait
  // already, kUnavailable if the pool has stopped.
  absl::Status Post(Task task);
  // Posts a task of accepted work, at once or after a delay, without a limit. False, and the task
  // is dropped, if the pool has stopped.
  bool PostMore(Task task);
  bool PostAfter(absl::Duration delay, Task task);

  // PostAfter() that can be cancelled; nothing if the pool has stopped.
  //   delay  any value; negative ones count as 0, those above kMaxDelay as kMaxDelay
  std::optional<Timer> StartTimer(absl::Duration delay, Task task);
  static constexpr absl::Duration kMaxDelay = absl::Hours(24 * 365);

  // Drops the task unless its time has come already.
  void Cancel(const Timer& timer);

  int64_t num_waiting() const;  // tasks whose time has come and that no thread has taken yet
  int64_t num_timers() const;   // tasks whose time has not come

  // Runs posted tasks, drops timers, and ends the threads. Idempotent.
  void Stop();

 private:
  void RunTasks();
  bool NextTask(Task& task);  // false: stopped
  void MoveDueTasks() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const size_t max_waiting_;
  mutable absl::Mutex mutex_;
  base::SteadyCondVar changed_;
  std::list<Task> ready_ ABSL_GUARDED_BY(mutex_);
  // Lists of one task each, so that no memory is needed to make them ready.
  std::map<Timer, std::list<Task>> later_ ABSL_GUARDED_BY(mutex_);
  int64_t num_started_timers_ ABSL_GUARDED_BY(mutex_) = 0;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace liquidblend::server

// Thread pool that makes frames, in the order of a FrameQueue.
#pragma once

#include <exception>
#include <list>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "core/parallel/helpers.h"
#include "server/frames/frame_queue.h"

namespace liquidblend::server {

// Pool of threads that make frames. A thread that finds no work in the queue helps with a frame
// that is being made (Helpers): so one frame uses all cores if there is no other work, and one core
// if there is. Threads: safe. Work that throws is logged and dropped; Run() rethrows an exception
// of a task when all are done.
class FramePool : public parallel::Helpers {
 public:
  struct Stats {
    int64_t waiting_cost = 0;  // cells
    int64_t num_refused = 0;
  };

  // Starts num_threads >= 1 threads.  Requires: options.Validate().ok().
  FramePool(int num_threads, const FrameQueueOptions& options);
  ~FramePool() override;  // Stop()
  FramePool(const FramePool&) = delete;
  FramePool& operator=(const FramePool&) = delete;

  // Takes on work.
  //   is_refusable  false for work that continues accepted work
  // Errors, and the work is dropped: kResourceExhausted if too much waits already (see
  // FrameQueue::HasRoomFor), with google.rpc.RetryInfo; kUnavailable if the pool has stopped.
  absl::StatusOr<FrameQueue::Place> Post(FrameWork work, bool is_refusable);

  // Runs the work of a caller that can wait, in its client's turn. Errors: Post()'s; the work's.
  absl::Status RunInTurn(const std::string& client, int64_t cost,
                         absl::FunctionRef<absl::Status()> work);

  // Drops work that has not begun.
  void Cancel(const FrameQueue::Place& place);

  // The cost of waiting work now, and the number of refusals since the start.
  Stats stats() const;

  int num_idle() const override;
  void Run(int num_tasks, absl::FunctionRef<void(int)> task) override;

  // Runs posted work, and ends the threads. Idempotent.
  void Stop();

 private:
  // Tasks of which some have not begun.
  struct Shared {
    Shared(absl::FunctionRef<void(int)> of, int count) : task(of), num_tasks(count) {}
    const absl::FunctionRef<void(int)> task;
    const int num_tasks;
    int next = 0;
    int num_running = 0;
    std::exception_ptr error;  // that a task ended with
  };

  void RunWork();
  bool Next(FrameWork& work);  // false: stopped
  // Runs the next one of the tasks, without the lock; takes them off the list with the last one.
  void RunTask(Shared& shared) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Duration TimeToDrain() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  mutable absl::Mutex mutex_;
  absl::CondVar changed_;
  absl::CondVar task_done_;
  FrameQueue queue_ ABSL_GUARDED_BY(mutex_);
  // Sums over finished work, with exponentially fading weight.
  double seconds_done_ ABSL_GUARDED_BY(mutex_);
  double cost_done_ ABSL_GUARDED_BY(mutex_);
  int64_t num_refused_ ABSL_GUARDED_BY(mutex_) = 0;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
  int num_idle_ ABSL_GUARDED_BY(mutex_) = 0;
  std::list<Shared*> shared_ ABSL_GUARDED_BY(mutex_);  // each has tasks that have not begun
  const int num_threads_;
  std::vector<std::thread> threads_;
};

}  // namespace liquidblend::server

#include "server/frames/frame_pool.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/base/work_pool.h"

namespace liquidblend::server {
namespace {

// Assumed speed of a core until it is measured: cells, and the seconds that they take.
constexpr double kFirstCost = 1e6;
constexpr double kFirstSeconds = 0.02;
constexpr double kMemory = 0.97;  // how much of the past counts after one more frame

constexpr absl::Duration kMinRetry = absl::Milliseconds(50);
constexpr absl::Duration kMaxRetry = absl::Seconds(10);

}  // namespace

FramePool::FramePool(int num_threads, const FrameQueueOptions& options)
    : queue_(options),
      seconds_done_(kFirstSeconds),
      cost_done_(kFirstCost),
      num_threads_(std::max(1, num_threads)) {
  for (int i = 0; i < num_threads_; ++i) threads_.emplace_back([this] { RunWork(); });
}

FramePool::~FramePool() { Stop(); }

absl::StatusOr<FrameQueue::Place> FramePool::Post(FrameWork work, bool is_refusable) {
  absl::MutexLock lock(&mutex_);
  if (stopped_) return absl::UnavailableError("the server is shutting down");
  if (is_refusable && !queue_.HasRoomFor(work)) {
    ++num_refused_;
    const absl::Status full = absl::ResourceExhaustedError(
        absl::StrCat("too busy: frames of ", queue_.waiting_cost(), " cells are waiting already"));
    return WithRetryDelay(full, std::clamp(TimeToDrain(), kMinRetry, kMaxRetry));
  }
  FrameQueue::Place place = queue_.Push(std::move(work));
  changed_.Signal();
  return place;
}

absl::Status FramePool::RunInTurn(const std::string& client, int64_t cost,
                                  absl::FunctionRef<absl::Status()> work) {
  absl::Status result;
  absl::Notification is_done;
  FrameWork posted;
  posted.client = client;
  posted.cost = std::max<int64_t>(1, cost);
  posted.deadline = SteadyNow();
  posted.run = [&] {
    result = Guarded(work);
    is_done.Notify();
  };
  const auto place = Post(std::move(posted), /*is_refusable=*/true);
  if (!place.ok()) return place.status();
  is_done.WaitForNotification();
  return result;
}

void FramePool::Cancel(const FrameQueue::Place& place) {
  std::optional<FrameWork> dropped;  // destroyed without the lock: work owns objects
  absl::MutexLock lock(&mutex_);
  dropped = queue_.Remove(place);
}

FramePool::Stats FramePool::stats() const {
  absl::MutexLock lock(&mutex_);
  return {queue_.waiting_cost(), num_refused_};
}

void FramePool::Stop() {
  {
    absl::MutexLock lock(&mutex_);
    stopped_ = true;
    changed_.SignalAll();
  }
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
}

void FramePool::RunWork() {
  FrameWork work;
  while (Next(work)) {
    const absl::Duration begin = SteadyNow();
    RunGuarded("making a frame", work.run);
    work.run = nullptr;
    absl::MutexLock lock(&mutex_);
    seconds_done_ = kMemory * seconds_done_ + absl::ToDoubleSeconds(SteadyNow() - begin);
    cost_done_ = kMemory * cost_done_ + static_cast<double>(work.cost);
  }
}

bool FramePool::Next(FrameWork& work) {
  absl::MutexLock lock(&mutex_);
  while (queue_.empty()) {
    if (!shared_.empty()) {
      RunTask(*shared_.front());
      continue;
    }
    if (stopped_) return false;
    ++num_idle_;
    changed_.Wait(&mutex_);
    --num_idle_;
  }
  work = queue_.Pop();
  if (!queue_.empty()) changed_.Signal();
  return true;
}

int FramePool::num_idle() const {
  absl::MutexLock lock(&mutex_);
  return num_idle_;
}

void FramePool::Run(int num_tasks, absl::FunctionRef<void(int)> task) {
  if (num_tasks <= 0) return;
  Shared shared(task, num_tasks);
  {
    absl::MutexLock lock(&mutex_);
    shared_.push_back(&shared);
    changed_.SignalAll();
    while (shared.next < num_tasks) RunTask(shared);
    while (shared.num_running > 0) task_done_.Wait(&mutex_);
  }
  if (shared.error != nullptr) std::rethrow_exception(shared.error);
}

void FramePool::RunTask(Shared& shared) {
  const int k = shared.next++;
  if (shared.next == shared.num_tasks) shared_.remove(&shared);
  ++shared.num_running;
  mutex_.Unlock();
  std::exception_ptr error;
  try {
    shared.task(k);
  } catch (...) {
    error = std::current_exception();
  }
  mutex_.Lock();
  if (error != nullptr) shared.error = error;
  if (--shared.num_running == 0) task_done_.SignalAll();
}

absl::Duration FramePool::TimeToDrain() const {
  const double cells_per_second = cost_done_ / seconds_done_ * num_threads_;
  return absl::Seconds(static_cast<double>(queue_.waiting_cost()) / cells_per_second);
}

}  // namespace liquidblend::server

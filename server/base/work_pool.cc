#include "server/base/work_pool.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/base/guarded.h"

namespace liquidblend::server {

absl::Duration SteadyNow() { return absl::FromChrono(WorkPool::Clock::now().time_since_epoch()); }

WorkPool::WorkPool(int num_threads, int max_waiting) : max_waiting_(std::max(1, max_waiting)) {
  for (int i = 0; i < std::max(1, num_threads); ++i) {
    threads_.emplace_back([this] { RunTasks(); });
  }
}

WorkPool::~WorkPool() { Stop(); }

absl::Status WorkPool::Post(Task task) {
  absl::MutexLock lock(&mutex_);
  if (stopped_) return absl::UnavailableError("the server is shutting down");
  if (ready_.size() >= max_waiting_) {
    return absl::ResourceExhaustedError(
        absl::StrCat("too busy: ", ready_.size(), " calls are waiting already; try again later"));
  }
  ready_.push_back(std::move(task));
  changed_.Signal();
  return absl::OkStatus();
}

bool WorkPool::PostMore(Task task) {
  absl::MutexLock lock(&mutex_);
  if (stopped_) return false;
  ready_.push_back(std::move(task));
  changed_.Signal();
  return true;
}

bool WorkPool::PostAfter(absl::Duration delay, Task task) {
  return StartTimer(delay, std::move(task)).has_value();
}

std::optional<WorkPool::Timer> WorkPool::StartTimer(absl::Duration delay, Task task) {
  const absl::Duration bounded = std::clamp(delay, absl::ZeroDuration(), kMaxDelay);
  std::list<Task> tasks;
  tasks.push_back(std::move(task));
  absl::MutexLock lock(&mutex_);
  if (stopped_) return std::nullopt;
  const Timer timer = {Clock::now() + absl::ToChronoNanoseconds(bounded), ++num_started_timers_};
  later_.emplace(timer, std::move(tasks));
  changed_.Signal();
  return timer;
}

void WorkPool::Cancel(const Timer& timer) {
  decltype(later_)::node_type dropped;  // destroyed without the lock: tasks own objects
  absl::MutexLock lock(&mutex_);
  dropped = later_.extract(timer);
}

int64_t WorkPool::num_waiting() const {
  absl::MutexLock lock(&mutex_);
  return static_cast<int64_t>(ready_.size());
}

int64_t WorkPool::num_timers() const {
  absl::MutexLock lock(&mutex_);
  return static_cast<int64_t>(later_.size());
}

void WorkPool::Stop() {
  decltype(later_) dropped;  // destroyed without the lock: tasks own objects
  {
    absl::MutexLock lock(&mutex_);
    stopped_ = true;
    dropped.swap(later_);
    changed_.SignalAll();
  }
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
}

void WorkPool::RunTasks() {
  Task task;
  while (NextTask(task)) {
    RunGuarded("a task", task);
    task = nullptr;
  }
}

bool WorkPool::NextTask(Task& task) {
  absl::MutexLock lock(&mutex_);
  while (true) {
    MoveDueTasks();
    if (!ready_.empty()) break;
    if (stopped_) return false;
    if (later_.empty()) {
      changed_.Wait(&mutex_);
    } else {
      changed_.WaitWithTimeout(&mutex_,
                               absl::FromChrono(later_.begin()->first.first - Clock::now()));
    }
  }
  task = std::move(ready_.front());
  ready_.pop_front();
  if (!ready_.empty() || !later_.empty()) changed_.Signal();
  return true;
}

void WorkPool::MoveDueTasks() {
  const Clock::time_point now = Clock::now();
  while (!later_.empty() && later_.begin()->first.first <= now) {
    ready_.splice(ready_.end(), later_.begin()->second);
    later_.erase(later_.begin());
  }
}

}  // namespace liquidblend::server

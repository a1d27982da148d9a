// Shared look: a slow query of a store whose answer is shared by concurrent callers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/base/work_pool.h"

namespace liquidblend::server {

struct SharedLookOptions {
  std::string name;      // of the store, for messages
  absl::Duration kept;   // >= 0; how long an answer is reused
  absl::Duration limit;  // > 0; of a caller's wait
};

// Owned by a shared_ptr.  Threads: safe.
template <typename Answer>
class SharedLook : public std::enable_shared_from_this<SharedLook<Answer>> {
 public:
  using Look = std::function<absl::StatusOr<Answer>()>;
  using Done = absl::AnyInvocable<void(const absl::StatusOr<Answer>&)>;

  //   lookers  has a thread for this look; one look runs at a time
  //   timers   ends waiting in time; its threads never block
  // Both outlive this.
  SharedLook(WorkPool& lookers, WorkPool& timers, Look look, SharedLookOptions options)
      : lookers_(lookers), timers_(timers), look_(std::move(look)), options_(std::move(options)) {}

  // Calls `done` once, at once or on a thread of the pools; it must not block.
  // Errors: the look's; kUnavailable if it takes longer than the limit, or the server stops.
  void Ask(Done done) {
    absl::ReleasableMutexLock lock(&mutex_);
    if (is_overdue_ || SteadyNow() - answered_at_ < options_.kept) {
      const absl::StatusOr<Answer> known = answer_;
      lock.Release();
      return done(known);
    }
    waiting_.push_back(std::move(done));
    const int64_t begun = std::exchange(is_looking_, true) ? 0 : ++num_looks_;
    lock.Release();
    if (begun > 0) Begin(begun);
  }

 private:
  void Begin(int64_t number) {
    const auto self = this->shared_from_this();
    std::optional<WorkPool::Timer> timer;
    const absl::Status begun = Guarded([&] {
      timer = timers_.StartTimer(options_.limit, [self, number] { self->GiveUp(number); });
      const bool is_posted = timer.has_value() && lookers_.PostMore([self, number, timer] {
        const absl::StatusOr<Answer> answer = Guarded(self->look_);
        self->timers_.Cancel(*timer);
        self->Finish(number, answer, /*is_overdue=*/false);
      });
      return is_posted ? absl::OkStatus() : ShuttingDown();
    });
    if (begun.ok()) return;
    if (timer.has_value()) timers_.Cancel(*timer);
    Finish(number, begun, /*is_overdue=*/false);
  }

  // Answers all callers with an error; later callers, too, until the look ends.
  void GiveUp(int64_t number) {
    Finish(number,
           absl::UnavailableError(absl::StrCat(options_.name, " has not answered within ",
                                               absl::FormatDuration(options_.limit))),
           /*is_overdue=*/true);
  }

  void Finish(int64_t number, const absl::StatusOr<Answer>& answer, bool is_overdue) {
    std::vector<Done> waiting;
    {
      absl::MutexLock lock(&mutex_);
      // The look may end at the moment when it becomes overdue.
      if (number != num_looks_ || !is_looking_) return;
      is_looking_ = is_overdue;
      is_overdue_ = is_overdue;
      answer_ = answer;
      answered_at_ = SteadyNow();
      waiting.swap(waiting_);
    }
    for (Done& done : waiting) RunGuarded("an answer", [&] { done(answer); });
  }

  WorkPool& lookers_;
  WorkPool& timers_;
  const Look look_;
  const SharedLookOptions options_;
  absl::Mutex mutex_;
  int64_t num_looks_ ABSL_GUARDED_BY(mutex_) = 0;  // begun so far
  bool is_looking_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_overdue_ ABSL_GUARDED_BY(mutex_) = false;  // the look that is under way
  absl::StatusOr<Answer> answer_ ABSL_GUARDED_BY(mutex_) = absl::UnknownError("never asked");
  absl::Duration answered_at_ ABSL_GUARDED_BY(mutex_) = -absl::InfiniteDuration();
  std::vector<Done> waiting_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::server

#include "server/api/operation_watch.h"

#include <algorithm>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/time/clock.h"
#include "server/api/served_operation.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"

namespace liquidblend::server {

OperationWatch::OperationWatch(Backends& backends, const std::string& name, IsWanted is_wanted)
    : backends_(backends),
      look_(WatchedOperation(backends, name)),
      is_wanted_(std::move(is_wanted)) {}

void OperationWatch::Next(Done done) {
  done_ = std::move(done);
  LookAfter(given_ == nullptr ? absl::ZeroDuration() : backends_.operation_looks.Interval());
}

void OperationWatch::AwaitDone(absl::Time deadline, Done done) {
  done_ = std::move(done);
  deadline_ = deadline;
  LookAfter(absl::ZeroDuration());
}

void OperationWatch::LookAfter(absl::Duration delay) {
  const absl::Status posted = Guarded([&] {
    // A pool that stops drops its timers, and `dropped` with them.
    absl::Cleanup dropped = [self = shared_from_this()] { self->Give(ShuttingDown()); };
    backends_.steps.PostAfter(delay,
                              [self = shared_from_this(), dropped = std::move(dropped)]() mutable {
                                std::move(dropped).Cancel();
                                self->Look();
                              });
    return absl::OkStatus();
  });
  if (!posted.ok()) Give(posted);
}

void OperationWatch::Look() {
  if (!is_wanted_()) return Give(absl::CancelledError("the client has gone"));
  const absl::Status asked = Guarded([&] {
    look_->Ask([self = shared_from_this()](const absl::StatusOr<SeenOperationPtr>& seen) {
      self->OnSeen(seen);
    });
    return absl::OkStatus();
  });
  if (!asked.ok()) Give(asked);
}

void OperationWatch::OnSeen(const absl::StatusOr<SeenOperationPtr>& seen) {
  if (!seen.ok()) return Give(seen.status());
  const absl::Duration remaining = Remaining(**seen);
  remaining > absl::ZeroDuration() ? LookAfter(remaining) : Give(*seen);
}

// Until the next look; zero: this is what the caller waits for.
absl::Duration OperationWatch::Remaining(const SeenOperation& seen) const {
  const absl::Duration interval = backends_.operation_looks.Interval();
  if (!deadline_.has_value()) {
    const bool is_known = given_ != nullptr && given_->bytes == seen.bytes;
    return is_known ? interval : absl::ZeroDuration();
  }
  return seen.operation.done() ? absl::ZeroDuration()
                               : std::min(*deadline_ - absl::Now(), interval);
}

void OperationWatch::Give(absl::StatusOr<SeenOperationPtr> result) {
  if (result.ok()) given_ = *result;
  Done done = std::exchange(done_, nullptr);
  if (done != nullptr) done(std::move(result));
}

absl::Time DeadlineOf(const google::longrunning::WaitOperationRequest& request) {
  if (!request.has_timeout()) return absl::InfiniteFuture();
  return absl::Now() + absl::Seconds(request.timeout().seconds()) +
         absl::Nanoseconds(request.timeout().nanos());
}

}  // namespace liquidblend::server

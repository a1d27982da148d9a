#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "core/base/status_macros.h"
#include "server/rpc/errors.h"
#include "server/rpc/frame_stream.h"
#include "server/rpc/guarded.h"
#include "server/rpc/streaming.h"

namespace liquidblend::rpc {
namespace {

using v1::StreamFramesRequest;
using v1::StreamFramesResponse;
using Reactor = grpc::ServerBidiReactor<StreamFramesRequest, StreamFramesResponse>;

absl::Duration Now() {
  return absl::FromChrono(std::chrono::steady_clock::now().time_since_epoch());
}

// Reads go on all the time and only leave behind the newest values. Everything else is done in
// steps on the pool, one at a time: take the newest values, wait until the next frame is due, make
// it, write it.
class StreamCall final : public Call<Reactor> {
 public:
  StreamCall(Backends& backends, OpenCalls& calls)
      : Call(calls), backends_(backends), stream_(backends) {}

  void OnReadDone(bool ok) override {
    {
      absl::MutexLock lock(&inbox_mutex_);
      is_half_closed_ = !ok;
      if (ok) {
        if (!newest_.has_value()) newest_.emplace();
        MergeRequest(read_, *newest_);
      }
    }
    if (ok) ReadNext();
    WantStep();
  }

  void OnWriteDone(bool ok) override {
    if (EndWrite(ok)) WantStep();
  }

 private:
  void Begin() override { ReadNext(); }

  void ReadNext() {
    Read([this] { StartRead(&read_); });
  }

  void WantStep() {
    {
      absl::MutexLock lock(&inbox_mutex_);
      if (std::exchange(is_step_wanted_, true) || is_stepping_) return;
    }
    const auto self = shared_from_this();
    if (!backends_.frames.PostMore([this, self] { TakeSteps(); })) {
      Close(absl::UnavailableError("the server is shutting down"));
    }
  }

  void TakeSteps() {
    while (BeginStep()) {
      const absl::Status status = Guarded([this] { return Step(); });
      if (!status.ok()) Close(status);
    }
  }

  bool BeginStep() {
    absl::MutexLock lock(&inbox_mutex_);
    is_stepping_ = std::exchange(is_step_wanted_, false);
    return is_stepping_;
  }

  absl::Status Step() {
    if (is_writing() || has_ended()) return absl::OkStatus();
    LB_RETURN_IF_ERROR(TakeNewest());
    if (!stream_.has_begun()) return absl::OkStatus();
    const absl::Duration now = Now();
    const std::optional<FramePacer::Tick> tick = stream_.Next(now);
    if (!tick.has_value()) {
      Close(absl::OkStatus());
    } else if (tick->due > now) {
      WakeAt(tick->due, now);
    } else {
      LB_ASSIGN_OR_RETURN(response_, stream_.Make(*tick));
      Write([this] { StartWrite(&response_); });
    }
    return absl::OkStatus();
  }

  absl::Status TakeNewest() {
    std::optional<StreamFramesRequest> newest;
    bool is_half_closed = false;
    {
      absl::MutexLock lock(&inbox_mutex_);
      newest.swap(newest_);
      is_half_closed = is_half_closed_;
    }
    if (newest.has_value()) return stream_.Change(*newest, Now());
    if (is_half_closed && !stream_.has_begun()) {
      return InvalidField("family", "must be named in the first message");
    }
    return absl::OkStatus();
  }

  // A step that comes too early only sets the next alarm, so one alarm at a time is enough.
  void WakeAt(absl::Duration due, absl::Duration now) {
    {
      absl::MutexLock lock(&inbox_mutex_);
      if (alarm_ <= due) return;
      alarm_ = due;
    }
    const auto self = shared_from_this();
    const auto wake = [this, self, due] {
      {
        absl::MutexLock lock(&inbox_mutex_);
        if (alarm_ == due) alarm_ = absl::InfiniteDuration();
      }
      WantStep();
    };
    if (!backends_.frames.PostAfter(due - now, wake)) {
      Close(absl::UnavailableError("the server is shutting down"));
    }
  }

  Backends& backends_;
  StreamFramesRequest read_;       // the read under way
  StreamFramesResponse response_;  // the write under way
  FrameStream stream_;             // the steps' own
  absl::Mutex inbox_mutex_;
  std::optional<StreamFramesRequest> newest_ ABSL_GUARDED_BY(inbox_mutex_);
  bool is_half_closed_ ABSL_GUARDED_BY(inbox_mutex_) = false;
  bool is_step_wanted_ ABSL_GUARDED_BY(inbox_mutex_) = false;
  bool is_stepping_ ABSL_GUARDED_BY(inbox_mutex_) = false;
  absl::Duration alarm_ ABSL_GUARDED_BY(inbox_mutex_) = absl::InfiniteDuration();
};

}  // namespace

Reactor* StreamFrames(Backends& backends, OpenCalls& calls) {
  return Call<Reactor>::Start<StreamCall>(backends, calls);
}

}  // namespace liquidblend::rpc

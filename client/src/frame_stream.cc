#include "liquidblend/frame_stream.h"

#include <grpcpp/alarm.h>

#include <atomic>
#include <functional>
#include <memory>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "client/src/client_impl.h"
#include "client/src/convert.h"
#include "client/src/servers.h"
#include "client/src/status_macros.h"
#include "client/src/stream_state.h"

namespace liquidblend {
namespace {

using ReaderWriter =
    grpc::ClientReaderWriterInterface<v1::StreamFramesRequest, v1::StreamFramesResponse>;

using Prepare = std::function<void(grpc::ClientContext*)>;

// One call of StreamFrames. The context must outlive the stream.
struct StreamCall {
  explicit StreamCall(client::Server& asked) : server(asked) {}
  client::Server& server;
  grpc::ClientContext context;
  std::unique_ptr<ReaderWriter> stream;
  bool has_received = false;              // reading thread only
  std::atomic<bool> is_too_late = false;  // a frame did not come in time
};

// Ends a call after a while, unless this ends before. Then the stream goes on with another call, or
// ends, too.
class Timeout {
 public:
  Timeout(const std::shared_ptr<StreamCall>& call, absl::Duration timeout, bool ends_stream) {
    if (timeout == absl::InfiniteDuration()) return;
    alarm_.Set(absl::ToChronoTime(absl::Now() + timeout), [call, ends_stream](bool is_over) {
      if (!is_over) return;
      if (ends_stream) call->is_too_late = true;
      call->context.TryCancel();
    });
  }
  // The destructor of the alarm cancels it; its function keeps the call for as long as it needs it.

 private:
  grpc::Alarm alarm_;
};

}  // namespace

class FrameStream::Impl {
 public:
  // `servers` and `known_versions` must outlive this.
  Impl(client::Servers& servers, client::KnownVersions& known_versions, Prepare prepare,
       const ConnectOptions& options, v1::StreamFramesRequest settings)
      : servers_(servers),
        known_versions_(known_versions),
        prepare_(std::move(prepare)),
        call_timeout_(options.call_timeout),
        backoff_(options.retry),
        round_(servers.Begin()),
        state_(WithMinVersion(settings)),
        first_version_(settings.version()) {
    Open(*round_.Next());
  }

  ~Impl() {
    if (ended_) return;
    Cancel();
    CurrentCall()->stream->Finish();
  }

  absl::StatusOr<std::optional<StreamedFrame>> Read(absl::Duration timeout) {
    while (!ended_) {
      v1::StreamFramesResponse response;
      const std::shared_ptr<StreamCall> call = CurrentCall();
      if (ReadCall(call, timeout, &response)) return Take(*call, std::move(response));
      last_status_ = EndOf(*call);
      client::Server* const next = call->is_too_late ? nullptr : NextServer(*call);
      if (call->is_too_late) {
        last_status_ = absl::DeadlineExceededError(
            absl::StrCat("the server has sent no frame for ", absl::FormatDuration(timeout)));
      }
      ended_ = next == nullptr;
      if (!ended_) Open(*next);
    }
    absl::MutexLock lock(&mutex_);
    closed_ = true;
    if (!last_status_.ok()) return last_status_;
    return std::optional<StreamedFrame>();
  }

  // A change that the server does not take any more counts for the one that follows.
  absl::Status Change(const StreamSettings& settings) {
    const v1::StreamFramesRequest change = WithMinVersion(client::ToProto(settings));
    absl::MutexLock write_lock(&write_mutex_);
    std::shared_ptr<StreamCall> call;
    {
      absl::MutexLock lock(&mutex_);
      if (closed_ || cancelled_) return absl::FailedPreconditionError("the stream has ended");
      first_version_ = 0;  // the first frame may be of the new one
      state_.Change(change);
      call = call_;
    }
    const Timeout end(call, call_timeout_, /*ends_stream=*/false);
    call->stream->Write(change);  // if it fails, Read gets the reason
    return absl::OkStatus();
  }

  void Cancel() {
    absl::MutexLock lock(&mutex_);
    cancelled_ = true;
    call_->context.TryCancel();
  }

 private:
  static bool ReadCall(const std::shared_ptr<StreamCall>& call, absl::Duration timeout,
                       v1::StreamFramesResponse* response) {
    const Timeout end(call, timeout, /*ends_stream=*/true);
    return call->stream->Read(response);
  }

  void Open(client::Server& server) {
    absl::MutexLock write_lock(&write_mutex_);
    auto call = std::make_shared<StreamCall>(server);
    prepare_(&call->context);
    v1::StreamFramesRequest first;
    {
      absl::MutexLock lock(&mutex_);
      first = state_.Begin();
      call_ = call;
      if (cancelled_) call->context.TryCancel();
    }
    // A server may hold both up. What is cancelled before it begins ends at once.
    const Timeout end(call, call_timeout_, /*ends_stream=*/false);
    call->stream = call->server.service().StreamFrames(&call->context);
    call->stream->Write(first);  // if it fails, Read gets the reason
  }

  absl::StatusOr<std::optional<StreamedFrame>> Take(StreamCall& call,
                                                    v1::StreamFramesResponse&& response) {
    backoff_.Reset();
    absl::MutexLock lock(&mutex_);
    if (!std::exchange(call.has_received, true)) {
      LBC_RETURN_IF_ERROR(client::CheckVersion(first_version_, response.frame().version()));
    }
    return std::optional<StreamedFrame>(state_.Take(std::move(response)));
  }

  // The server at which the stream goes on after last_status_; null: it has ended.
  client::Server* NextServer(const StreamCall& call) {
    if (absl::IsNotFound(last_status_)) return AllowNewerVersion() ? &call.server : nullptr;
    if (!absl::IsUnavailable(last_status_)) return NextAfterWait();
    round_.OnUnavailable(last_status_);
    if (IsComplete()) last_status_ = absl::OkStatus();
    if (last_status_.ok() || !CanGoOn()) return nullptr;
    if (call.has_received) round_ = servers_.Begin();
    client::Server* const next = round_.Next();
    return next != nullptr ? next : NextAfterWait();
  }

  client::Server* NextAfterWait() {
    if (!CanGoOn() || !backoff_.ShouldRetry(last_status_)) return nullptr;
    if (CancelledWithin(backoff_.NextWait())) return nullptr;
    round_ = servers_.Begin();
    return round_.Next();
  }

  v1::StreamFramesRequest WithMinVersion(v1::StreamFramesRequest request) const {
    const bool says_which = request.min_version() != 0 || request.version() != 0;
    if (request.family().empty() || says_which) return request;
    request.set_min_version(known_versions_.Of(request.family()));
    return request;
  }

  bool AllowNewerVersion() {
    absl::MutexLock lock(&mutex_);
    if (state_.AllowNewerVersion()) return true;
    known_versions_.Forget(state_.family());
    return false;
  }

  bool CanGoOn() {
    absl::MutexLock lock(&mutex_);
    return state_.CanGoOn();
  }

  bool IsComplete() {
    absl::MutexLock lock(&mutex_);
    return state_.IsComplete();
  }

  absl::Status EndOf(StreamCall& call) {
    const absl::Status status = client::FromGrpc(call.stream->Finish());
    absl::MutexLock lock(&mutex_);
    if (!cancelled_ || !absl::IsUnavailable(status)) return status;
    return absl::CancelledError("the stream was cancelled");
  }

  std::shared_ptr<StreamCall> CurrentCall() {
    absl::MutexLock lock(&mutex_);
    return call_;
  }

  bool CancelledWithin(absl::Duration wait) {
    absl::MutexLock lock(&mutex_);
    return mutex_.AwaitWithTimeout(absl::Condition(&cancelled_), wait);
  }

  client::Servers& servers_;
  client::KnownVersions& known_versions_;
  const Prepare prepare_;
  const absl::Duration call_timeout_;  // of what begins or changes a call
  client::Backoff backoff_;            // reading thread only, like the next three
  client::Servers::Round round_;       // the attempt that call_ belongs to
  bool ended_ = false;                 // nothing more will come, for last_status_
  absl::Status last_status_;           // of the last call

  absl::Mutex write_mutex_;  // one write at a time; taken before mutex_, never while reading
  absl::Mutex mutex_;        // held only briefly, so that Cancel never waits
  client::StreamState state_ ABSL_GUARDED_BY(mutex_);
  int64_t first_version_ ABSL_GUARDED_BY(mutex_);  // that was asked for; 0: none, or not any more
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  std::shared_ptr<StreamCall> call_ ABSL_GUARDED_BY(mutex_);
};

FrameStream::FrameStream(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
FrameStream::~FrameStream() = default;

absl::StatusOr<std::optional<StreamedFrame>> FrameStream::Read(absl::Duration timeout) {
  return impl_->Read(timeout);
}
absl::Status FrameStream::Change(const StreamSettings& settings) { return impl_->Change(settings); }
void FrameStream::Cancel() { impl_->Cancel(); }

absl::StatusOr<std::unique_ptr<FrameStream>> Client::StreamFrames(const StreamSettings& settings) {
  if (settings.family.empty()) {
    return absl::InvalidArgumentError("StreamSettings.family is empty; a stream starts with one");
  }
  const auto prepare = [client = impl_.get()](grpc::ClientContext* context) {
    client->Prepare(absl::InfiniteDuration(), context);
  };
  auto impl = std::make_unique<FrameStream::Impl>(*impl_->servers, impl_->known_versions, prepare,
                                                  impl_->options, client::ToProto(settings));
  return std::unique_ptr<FrameStream>(new FrameStream(std::move(impl)));
}

}  // namespace liquidblend

#include "liquidblend/frame_stream.h"

#include <functional>
#include <memory>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "client/src/client_impl.h"
#include "client/src/convert.h"
#include "client/src/servers.h"
#include "client/src/status_macros.h"

namespace liquidblend {
namespace {

using ReaderWriter =
    grpc::ClientReaderWriterInterface<v1::StreamFramesRequest, v1::StreamFramesResponse>;

using Prepare = std::function<void(grpc::ClientContext*)>;

// One attempt. The context must outlive the stream.
struct StreamCall {
  explicit StreamCall(client::Server& asked) : server(asked) {}
  client::Server& server;
  grpc::ClientContext context;
  std::unique_ptr<ReaderWriter> stream;
};

void Merge(const v1::StreamFramesRequest& change, v1::StreamFramesRequest* state) {
  if (change.weights_size() > 0 || change.parameters_size() > 0) {
    state->clear_weights();
    state->clear_parameters();
  }
  if (change.has_surface()) state->clear_surface();
  if (change.encoding().position_bits() != 0 || change.encoding().position_step_m() != 0) {
    state->mutable_encoding()->clear_position_bits();
    state->mutable_encoding()->clear_position_step_m();
  }
  if (!change.family().empty() || change.version() != 0 || change.min_version() != 0) {
    state->clear_version();
    state->clear_min_version();
  }
  state->MergeFrom(change);
}

StreamedFrame FromProto(v1::StreamFramesResponse&& response) {
  return {client::FromProto(std::move(*response.mutable_frame())), response.frame_index(),
          response.num_dropped(), response.level_of_detail()};
}

}  // namespace

class FrameStream::Impl {
 public:
  // `servers` and `known_versions` must outlive this.
  Impl(client::Servers& servers, client::KnownVersions& known_versions, Prepare prepare,
       const RetryOptions& retry, v1::StreamFramesRequest settings)
      : servers_(servers),
        known_versions_(known_versions),
        prepare_(std::move(prepare)),
        backoff_(retry),
        settings_(std::move(settings)),
        first_version_(settings_.version()) {
    SetMinVersion(settings_);
    Open();
  }

  ~Impl() {
    if (ended_) return;
    Cancel();
    CurrentCall()->stream->Finish();
  }

  absl::StatusOr<std::optional<StreamedFrame>> Read() {
    while (!ended_) {
      v1::StreamFramesResponse response;
      const std::shared_ptr<StreamCall> call = CurrentCall();
      if (call->stream->Read(&response)) {
        if (!std::exchange(received_, true)) {
          LBC_RETURN_IF_ERROR(CheckFirst(response.frame().version()));
        }
        return std::optional<StreamedFrame>(FromProto(std::move(response)));
      }
      last_status_ = EndOf(*call);
      if (absl::IsNotFound(last_status_)) ForgetVersion();
      if (absl::IsUnavailable(last_status_)) servers_.Leave(call->server);
      // Once a frame has come, opening again would repeat frames: then the caller has to decide.
      ended_ = received_ || !backoff_.ShouldRetry(last_status_) || CancelledWithin(NextWait());
      if (!ended_) Open();
    }
    absl::MutexLock lock(&mutex_);
    closed_ = true;
    if (!last_status_.ok()) return last_status_;
    return std::optional<StreamedFrame>();
  }

  absl::Status Change(const StreamSettings& settings) {
    v1::StreamFramesRequest change = client::ToProto(settings);
    SetMinVersion(change);
    absl::MutexLock write_lock(&write_mutex_);
    std::shared_ptr<StreamCall> call;
    {
      absl::MutexLock lock(&mutex_);
      if (closed_) return absl::FailedPreconditionError("the stream has ended");
      first_version_ = 0;  // the first frame may be of the new one
      Merge(change, &settings_);
      call = call_;
    }
    if (call->stream->Write(change)) return absl::OkStatus();
    return absl::FailedPreconditionError("the stream has ended; Read says why");
  }

  void Cancel() {
    absl::MutexLock lock(&mutex_);
    cancelled_ = true;
    call_->context.TryCancel();
  }

 private:
  void Open() {
    absl::MutexLock write_lock(&write_mutex_);
    auto call = std::make_shared<StreamCall>(servers_.current());
    prepare_(&call->context);
    v1::StreamFramesRequest first;
    {
      absl::MutexLock lock(&mutex_);
      first = settings_;
      call->stream = call->server.service().StreamFrames(&call->context);
      call_ = call;
      if (cancelled_) call->context.TryCancel();
    }
    call->stream->Write(first);  // if it fails, Read gets the reason
  }

  void SetMinVersion(v1::StreamFramesRequest& request) const {
    const bool says_which = request.min_version() != 0 || request.version() != 0;
    if (request.family().empty() || says_which) return;
    request.set_min_version(known_versions_.Of(request.family()));
  }

  absl::Status CheckFirst(int64_t version) {
    int64_t asked = 0;
    {
      absl::MutexLock lock(&mutex_);
      asked = first_version_;
    }
    return client::CheckVersion(asked, version);
  }

  void ForgetVersion() {
    absl::MutexLock lock(&mutex_);
    known_versions_.Forget(settings_.family());
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

  absl::Duration NextWait() { return backoff_.NextWait(); }

  bool CancelledWithin(absl::Duration wait) {
    absl::MutexLock lock(&mutex_);
    return mutex_.AwaitWithTimeout(absl::Condition(&cancelled_), wait);
  }

  client::Servers& servers_;
  client::KnownVersions& known_versions_;
  const Prepare prepare_;
  client::Backoff backoff_;   // reading thread only, like the next three
  bool received_ = false;     // a frame has come
  bool ended_ = false;        // nothing more will come, for last_status_
  absl::Status last_status_;  // of the last attempt

  absl::Mutex write_mutex_;  // one write at a time; taken before mutex_, never while reading
  absl::Mutex mutex_;        // held only briefly, so that Cancel never waits
  v1::StreamFramesRequest settings_ ABSL_GUARDED_BY(mutex_);  // all changes so far, for Open
  int64_t first_version_ ABSL_GUARDED_BY(mutex_);  // that was asked for; 0: none, or not any more
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  std::shared_ptr<StreamCall> call_ ABSL_GUARDED_BY(mutex_);
};

FrameStream::FrameStream(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
FrameStream::~FrameStream() = default;

absl::StatusOr<std::optional<StreamedFrame>> FrameStream::Read() { return impl_->Read(); }
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
                                                  impl_->options.retry, client::ToProto(settings));
  return std::unique_ptr<FrameStream>(new FrameStream(std::move(impl)));
}

}  // namespace liquidblend

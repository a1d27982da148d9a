#include <memory>
#include <utility>

#include "server/base/errors.h"
#include "server/frames/stream_session.h"
#include "server/grpc/byte_buffers.h"
#include "server/grpc/call.h"
#include "server/grpc/streaming.h"

namespace liquidblend::server {
namespace {

using StreamReactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;

// The wire of a StreamSession. Reads go on all the time.
class StreamCall final : public Call<StreamReactor>, public StreamSession::Sink {
 public:
  StreamCall(Backends& backends, std::shared_ptr<Admission> admission)
      : Call(std::move(admission)), backends_(backends) {}

  // The call is over, or the client has gone.
  ~StreamCall() override {
    if (session_ != nullptr) session_->Stop();
  }

  void OnReadDone(bool ok) override {
    Attempt([this, ok] { ok ? TakeRequest() : session_->OnHalfClosed(); });
  }

  void OnWriteDone(bool ok) override {
    const bool goes_on = EndWrite(ok);
    response_.Clear();  // lets the frame go; the next one may be far away
    if (goes_on) Attempt([this] { session_->OnWritten(); });
  }

  void Send(const StreamedFrame& streamed) override {
    response_ = ToByteBuffer(streamed);
    Write([this] { StartWrite(&response_); });
  }

  void End(const absl::Status& status) override { Close(status); }

  std::string account() const override { return caller().principal.key; }

  // The write under way ends without success.
  void GiveUp() override { CancelCall(); }

 private:
  void Begin() override {
    const auto self = std::static_pointer_cast<StreamCall>(shared_from_this());
    session_ = std::make_shared<StreamSession>(backends_, caller().client, self, caller().span);
    ReadNext();
  }

  void TakeRequest() {
    v1::StreamFramesRequest request;
    const absl::Status parsed = Parse(read_, "StreamFrames", request);
    if (!parsed.ok()) return Close(parsed);
    if (!request.family().empty()) set_resource(CleanText(request.family(), 80));
    session_->OnRequest(request);
    ReadNext();
  }

  void ReadNext() {
    Read([this] { StartRead(&read_); });
  }

  Backends& backends_;
  std::shared_ptr<StreamSession> session_;
  grpc::ByteBuffer read_;      // the read under way
  grpc::ByteBuffer response_;  // the write under way
};

}  // namespace

StreamReactor* StreamFrames(Backends& backends, std::shared_ptr<Admission> admission) {
  return Call<StreamReactor>::Start<StreamCall>(backends, std::move(admission));
}

}  // namespace liquidblend::server

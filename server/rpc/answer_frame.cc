#include <atomic>
#include <memory>
#include <utility>

#include "core/base/status_macros.h"
#include "server/rpc/admission.h"
#include "server/rpc/errors.h"
#include "server/rpc/frame_message.h"
#include "server/rpc/get_frame.h"
#include "server/rpc/guarded.h"
#include "server/rpc/streaming.h"

namespace liquidblend::rpc {
namespace {

class FrameReactor final : public grpc::ServerUnaryReactor {
 public:
  FrameReactor(Backends& backends, std::shared_ptr<Admission> admission,
               const grpc::ByteBuffer& bytes, grpc::ByteBuffer* response)
      : admission_(std::move(admission)) {
    const absl::Status begun = Guarded([&] { return Begin(backends, bytes, response); });
    if (!begun.ok()) End(begun);
  }

  // Also when the call's deadline passes.
  void OnCancel() override {
    if (call_ != nullptr) call_->Cancel();
  }

  void OnDone() override { delete this; }

 private:
  absl::Status Begin(Backends& backends, const grpc::ByteBuffer& bytes,
                     grpc::ByteBuffer* response) {
    v1::GetFrameRequest request;
    LB_RETURN_IF_ERROR(Parse(bytes, "GetFrame", request));
    admission_->set_resource(CleanText(request.family(), 80));
    call_ = FrameCall::Start(backends, request, admission_->caller().client,
                             [this, response](const absl::StatusOr<AnsweredFrame>& made) {
                               if (made.ok()) *response = ToByteBuffer(made->bytes);
                               End(made.status());
                             });
    return absl::OkStatus();
  }

  // The first end counts.
  void End(const absl::Status& status) {
    if (!has_ended_.exchange(true)) Finish(admission_->End(status));
  }

  const std::shared_ptr<Admission> admission_;
  std::atomic<bool> has_ended_ = false;
  std::shared_ptr<FrameCall> call_;
};

}  // namespace

grpc::ServerUnaryReactor* AnswerFrame(Backends& backends, std::shared_ptr<Admission> admission,
                                      const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  return std::make_unique<FrameReactor>(backends, std::move(admission), *request, response)
      .release();
}

}  // namespace liquidblend::rpc

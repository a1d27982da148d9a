#include <memory>
#include <utility>

#include "server/rpc/admission.h"
#include "server/rpc/errors.h"
#include "server/rpc/frame_message.h"
#include "server/rpc/get_frame.h"
#include "server/rpc/streaming.h"

namespace liquidblend::rpc {
namespace {

class FrameReactor final : public grpc::ServerUnaryReactor {
 public:
  FrameReactor(Backends& backends, std::shared_ptr<Admission> admission,
               const grpc::ByteBuffer& bytes, grpc::ByteBuffer* response)
      : admission_(std::move(admission)) {
    v1::GetFrameRequest request;
    const absl::Status parsed = Parse(bytes, "GetFrame", request);
    if (!parsed.ok()) {
      Finish(admission_->End(parsed));
      return;
    }
    admission_->set_resource(CleanText(request.family(), 80));
    call_ = FrameCall::Start(backends, request, admission_->caller().client,
                             [this, response](const absl::StatusOr<FramePtr>& made) {
                               if (made.ok()) *response = ToByteBuffer(*made);
                               Finish(admission_->End(made.status()));
                             });
  }

  // Also when the call's deadline passes.
  void OnCancel() override {
    if (call_ != nullptr) call_->Cancel();
  }

  void OnDone() override { delete this; }

 private:
  const std::shared_ptr<Admission> admission_;
  std::shared_ptr<FrameCall> call_;
};

}  // namespace

grpc::ServerUnaryReactor* AnswerFrame(Backends& backends, std::shared_ptr<Admission> admission,
                                      const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  return std::make_unique<FrameReactor>(backends, std::move(admission), *request, response)
      .release();
}

}  // namespace liquidblend::rpc

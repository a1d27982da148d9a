#include <atomic>
#include <memory>
#include <utility>

#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/frames/get_frame.h"
#include "server/grpc/admission.h"
#include "server/grpc/held_answer.h"
#include "server/grpc/streaming.h"

namespace liquidblend::server {
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
    is_cancelled_.store(true, std::memory_order_release);
  }

  void OnDone() override {
    // gRPC calls this after OnCancel(), but ThreadSanitizer cannot see how.
    is_cancelled_.load(std::memory_order_acquire);
    admission_->OnDone();
    const trace::Span& span = admission_->caller().span;
    if (span.is_recording()) span.RecordChild("write", ended_at_, absl::Now());
    delete this;
  }

 private:
  absl::Status Begin(Backends& backends, const grpc::ByteBuffer& bytes,
                     grpc::ByteBuffer* response) {
    v1::GetFrameRequest request;
    LB_RETURN_IF_ERROR(admission_->Read(bytes, request));
    call_ = FrameCall::Start(
        backends, request, admission_->caller().client,
        [this, &backends, response](const absl::StatusOr<AnsweredFrame>& made) {
          End(made.ok() ? Guarded([&] { return Answer(backends, made->bytes, response); })
                        : made.status());
        },
        admission_->caller().span);
    return absl::OkStatus();
  }

  absl::Status Answer(Backends& backends, const FramePtr& frame, grpc::ByteBuffer* response) {
    LB_ASSIGN_OR_RETURN(*response, HoldAnswer(backends, admission_, frame));
    return absl::OkStatus();
  }

  // The first end counts.
  void End(const absl::Status& status) {
    if (has_ended_.exchange(true)) return;
    ended_at_ = absl::Now();
    Finish(admission_->End(status));
  }

  const std::shared_ptr<Admission> admission_;
  std::atomic<bool> has_ended_ = false;
  std::atomic<bool> is_cancelled_ = false;
  absl::Time ended_at_;  // then the answer goes out
  std::shared_ptr<FrameCall> call_;
};

}  // namespace

grpc::ServerUnaryReactor* AnswerFrame(Backends& backends, std::shared_ptr<Admission> admission,
                                      const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  return std::make_unique<FrameReactor>(backends, std::move(admission), *request, response)
      .release();
}

}  // namespace liquidblend::server

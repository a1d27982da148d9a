#include "server/grpc/services.h"

#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "server/api/handlers.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/grpc/refused_call.h"
#include "server/grpc/streaming.h"

namespace liquidblend::server {
namespace {

// Nobody waits for the answer to such a call any more.
absl::Status CheckIsWanted(const CallbackServerContext& context) {
  if (context.IsCancelled()) return absl::CancelledError("the client has cancelled the call");
  if (context.deadline() < std::chrono::system_clock::now()) {
    return absl::DeadlineExceededError("the deadline passed before the call's turn came");
  }
  return absl::OkStatus();
}

// Ends a call that was not admitted.
template <typename Reactor>
Reactor* Refuse(Admission& admission) {
  return new RefusedCall<Reactor>(admission.End(admission.verdict()));
}

// Answers one call on the pool.
template <typename Handle, typename Request, typename Response>
ServerUnaryReactor* Answer(CallbackServerContext* context, std::shared_ptr<Admission> admission,
                           Backends& backends, WorkPool& pool, const Handle& handle,
                           const Request* request, Response* response) {
  ServerUnaryReactor* const reactor = context->DefaultReactor();
  absl::Status accepted = admission->verdict();
  if (accepted.ok()) {
    const auto answer = [=, &backends] {
      const absl::Status status = Guarded([&]() -> absl::Status {
        LB_RETURN_IF_ERROR(CheckIsWanted(*context));
        LB_ASSIGN_OR_RETURN(*response, handle(backends, *request));
        return absl::OkStatus();
      });
      reactor->Finish(admission->End(status));
    };
    accepted = Guarded([&] { return pool.Post(answer); });
  }
  if (!accepted.ok()) reactor->Finish(admission->End(accepted));
  return reactor;
}

constexpr Method kUploadAnimation = {"UploadAnimation", Scope::kWrite, Effect::kChanges,
                                     Span::kLasts};
constexpr Method kPresignUpload = {"PresignUpload", Scope::kWrite};
constexpr Method kPresignDownload = {"PresignDownload", Scope::kFrames};
constexpr Method kImportAnimation = {"ImportAnimation", Scope::kWrite, Effect::kChanges,
                                     Span::kLasts, int64_t{256} << 10};  // 20,000 times of frames
constexpr Method kGetAnimation = {"GetAnimation", std::nullopt};
constexpr Method kListAnimations = {"ListAnimations", std::nullopt};
constexpr Method kDeleteAnimation = {"DeleteAnimation", Scope::kWrite, Effect::kChanges};
constexpr Method kRegisterFamily = {
    "RegisterFamily", Scope::kRegister, Effect::kChanges, Span::kShort,
    std::numeric_limits<int64_t>::max()};  // gRPC's limit: correspondences are many
constexpr Method kGetFamily = {"GetFamily", std::nullopt};
constexpr Method kListFamilies = {"ListFamilies", std::nullopt};
constexpr Method kRollbackFamily = {"RollbackFamily", Scope::kRegister, Effect::kChanges};
constexpr Method kDeleteFamily = {"DeleteFamily", Scope::kRegister, Effect::kChanges};
constexpr Method kWatchOperation = {"WatchOperation", std::nullopt, Effect::kReads, Span::kLasts};
constexpr Method kGetFrame = {"GetFrame", Scope::kFrames};
constexpr Method kStreamFrames = {"StreamFrames", Scope::kFrames, Effect::kReads, Span::kLasts};
constexpr Method kListOperations = {"ListOperations", std::nullopt};
constexpr Method kGetOperation = {"GetOperation", std::nullopt};
constexpr Method kDeleteOperation = {"DeleteOperation", Scope::kRegister, Effect::kChanges};
constexpr Method kCancelOperation = {"CancelOperation", Scope::kRegister, Effect::kChanges};
constexpr Method kWaitOperation = {"WaitOperation", std::nullopt, Effect::kReads, Span::kLasts};

}  // namespace

grpc::ServerReadReactor<grpc::ByteBuffer>* LiquidBlendService::UploadAnimation(
    CallbackServerContext* context, grpc::ByteBuffer* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kUploadAnimation);
  if (!admission->verdict().ok()) {
    return Refuse<grpc::ServerReadReactor<grpc::ByteBuffer>>(*admission);
  }
  return server::UploadAnimation(backends_, std::move(admission), context, response);
}

ServerUnaryReactor* LiquidBlendService::PresignUpload(CallbackServerContext* context,
                                                      const v1::PresignUploadRequest* request,
                                                      v1::PresignUploadResponse* response) {
  const std::shared_ptr<Admission> admission =
      interceptor_.Admit(*context, kPresignUpload, *request);
  const auto handle = [admission](Backends& backends, const v1::PresignUploadRequest& asked) {
    return server::PresignUpload(backends, asked, admission->caller().principal);
  };
  return Answer(context, admission, backends_, backends_.transfers, handle, request, response);
}

ServerUnaryReactor* LiquidBlendService::PresignDownload(CallbackServerContext* context,
                                                        const v1::PresignDownloadRequest* request,
                                                        v1::PresignDownloadResponse* response) {
  return Answer(context, interceptor_.Admit(*context, kPresignDownload, *request), backends_,
                backends_.transfers, server::PresignDownload, request, response);
}

ServerUnaryReactor* LiquidBlendService::ImportAnimation(CallbackServerContext* context,
                                                        const v1::ImportAnimationRequest* request,
                                                        lro::Operation* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kImportAnimation, *request);
  if (!admission->verdict().ok()) return Refuse<ServerUnaryReactor>(*admission);
  return server::ImportAnimation(backends_, std::move(admission), roots_, request, response);
}

ServerUnaryReactor* LiquidBlendService::GetAnimation(CallbackServerContext* context,
                                                     const v1::GetAnimationRequest* request,
                                                     v1::Animation* response) {
  return Answer(context, interceptor_.Admit(*context, kGetAnimation, *request), backends_,
                backends_.io, server::GetAnimation, request, response);
}

ServerUnaryReactor* LiquidBlendService::ListAnimations(CallbackServerContext* context,
                                                       const v1::ListAnimationsRequest* request,
                                                       v1::ListAnimationsResponse* response) {
  return Answer(context, interceptor_.Admit(*context, kListAnimations, *request), backends_,
                backends_.io, server::ListAnimations, request, response);
}

ServerUnaryReactor* LiquidBlendService::DeleteAnimation(CallbackServerContext* context,
                                                        const v1::DeleteAnimationRequest* request,
                                                        Empty* response) {
  return Answer(context, interceptor_.Admit(*context, kDeleteAnimation, *request), backends_,
                backends_.io, server::DeleteAnimation, request, response);
}

ServerUnaryReactor* LiquidBlendService::RegisterFamily(CallbackServerContext* context,
                                                       const v1::RegisterFamilyRequest* request,
                                                       lro::Operation* response) {
  const std::shared_ptr<Admission> admission =
      interceptor_.Admit(*context, kRegisterFamily, *request);
  const auto handle = [admission](Backends& backends, const v1::RegisterFamilyRequest& asked) {
    return server::RegisterFamily(backends, asked, admission->caller().principal);
  };
  return Answer(context, admission, backends_, backends_.io, handle, request, response);
}

ServerUnaryReactor* LiquidBlendService::GetFamily(CallbackServerContext* context,
                                                  const v1::GetFamilyRequest* request,
                                                  v1::Family* response) {
  return Answer(context, interceptor_.Admit(*context, kGetFamily, *request), backends_,
                backends_.io, server::GetFamily, request, response);
}

ServerUnaryReactor* LiquidBlendService::ListFamilies(CallbackServerContext* context,
                                                     const v1::ListFamiliesRequest* request,
                                                     v1::ListFamiliesResponse* response) {
  return Answer(context, interceptor_.Admit(*context, kListFamilies, *request), backends_,
                backends_.io, server::ListFamilies, request, response);
}

ServerUnaryReactor* LiquidBlendService::RollbackFamily(CallbackServerContext* context,
                                                       const v1::RollbackFamilyRequest* request,
                                                       v1::Family* response) {
  return Answer(context, interceptor_.Admit(*context, kRollbackFamily, *request), backends_,
                backends_.io, server::RollbackFamily, request, response);
}

ServerUnaryReactor* LiquidBlendService::DeleteFamily(CallbackServerContext* context,
                                                     const v1::DeleteFamilyRequest* request,
                                                     Empty* response) {
  return Answer(context, interceptor_.Admit(*context, kDeleteFamily, *request), backends_,
                backends_.io, server::DeleteFamily, request, response);
}

grpc::ServerWriteReactor<lro::Operation>* LiquidBlendService::WatchOperation(
    CallbackServerContext* context, const v1::WatchOperationRequest* request) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kWatchOperation, *request);
  if (!admission->verdict().ok()) {
    return Refuse<grpc::ServerWriteReactor<lro::Operation>>(*admission);
  }
  return server::WatchOperation(backends_, std::move(admission), request);
}

ServerUnaryReactor* LiquidBlendService::GetFrame(CallbackServerContext* context,
                                                 const grpc::ByteBuffer* request,
                                                 grpc::ByteBuffer* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kGetFrame);
  if (!admission->verdict().ok()) return Refuse<ServerUnaryReactor>(*admission);
  return AnswerFrame(backends_, std::move(admission), request, response);
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* LiquidBlendService::StreamFrames(
    CallbackServerContext* context) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kStreamFrames);
  if (!admission->verdict().ok()) {
    return Refuse<grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>>(*admission);
  }
  return server::StreamFrames(backends_, std::move(admission));
}

ServerUnaryReactor* OperationsService::ListOperations(CallbackServerContext* context,
                                                      const lro::ListOperationsRequest* request,
                                                      lro::ListOperationsResponse* response) {
  return Answer(context, interceptor_.Admit(*context, kListOperations, *request), backends_,
                backends_.io, server::ListOperations, request, response);
}

ServerUnaryReactor* OperationsService::GetOperation(CallbackServerContext* context,
                                                    const lro::GetOperationRequest* request,
                                                    lro::Operation* response) {
  return Answer(context, interceptor_.Admit(*context, kGetOperation, *request), backends_,
                backends_.io, server::GetOperation, request, response);
}

ServerUnaryReactor* OperationsService::DeleteOperation(CallbackServerContext* context,
                                                       const lro::DeleteOperationRequest* request,
                                                       Empty* response) {
  return Answer(context, interceptor_.Admit(*context, kDeleteOperation, *request), backends_,
                backends_.io, server::DeleteOperation, request, response);
}

ServerUnaryReactor* OperationsService::CancelOperation(CallbackServerContext* context,
                                                       const lro::CancelOperationRequest* request,
                                                       Empty* response) {
  return Answer(context, interceptor_.Admit(*context, kCancelOperation, *request), backends_,
                backends_.io, server::CancelOperation, request, response);
}

ServerUnaryReactor* OperationsService::WaitOperation(CallbackServerContext* context,
                                                     const lro::WaitOperationRequest* request,
                                                     lro::Operation* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kWaitOperation, *request);
  if (!admission->verdict().ok()) return Refuse<ServerUnaryReactor>(*admission);
  return server::WaitOperation(backends_, std::move(admission), request, response);
}

}  // namespace liquidblend::server

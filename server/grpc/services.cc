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
#include "server/grpc/byte_buffers.h"
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

// Ends a call before it begins.
template <typename Reactor>
Reactor* Refuse(Admission& admission, const absl::Status& refusal) {
  return new RefusedCall<Reactor>(admission.End(refusal));
}

// The request of a call, or why the call is refused.
template <typename Request>
absl::StatusOr<Request> ReadRequest(Admission& admission, const ByteBuffer& bytes) {
  LB_RETURN_IF_ERROR(admission.verdict());
  return Guarded([&]() -> absl::StatusOr<Request> {
    Request request;
    LB_RETURN_IF_ERROR(admission.Read(bytes, request));
    return request;
  });
}

// A call with one request and one answer.
struct UnaryCall {
  CallbackServerContext* context;
  std::shared_ptr<Admission> admission;
  const ByteBuffer* request;
  ByteBuffer* response;
};

// Answers the call on the pool, or refuses it at once.
//   handle  (const Request&) -> absl::StatusOr of a message
template <typename Request, typename Handle>
ServerUnaryReactor* AnswerWith(const Handle& handle, const UnaryCall& call, WorkPool& pool) {
  ServerUnaryReactor* const reactor = call.context->DefaultReactor();
  const absl::Status posted = Guarded([&]() -> absl::Status {
    LB_ASSIGN_OR_RETURN(Request read, ReadRequest<Request>(*call.admission, *call.request));
    const auto request = std::make_shared<const Request>(std::move(read));
    return pool.Post([=] {
      const absl::Status status = Guarded([&]() -> absl::Status {
        LB_RETURN_IF_ERROR(CheckIsWanted(*call.context));
        LB_ASSIGN_OR_RETURN(const auto response, handle(*request));
        *call.response = ToByteBuffer(response.SerializeAsString());
        return absl::OkStatus();
      });
      reactor->Finish(call.admission->End(status));
    });
  });
  if (!posted.ok()) reactor->Finish(call.admission->End(posted));
  return reactor;
}

// The same with a handler of handlers.h.
template <typename Request, typename Response>
ServerUnaryReactor* Answer(absl::StatusOr<Response> (*handler)(Backends&, const Request&),
                           Backends& backends, const UnaryCall& call, WorkPool& pool) {
  const auto handle = [=, &backends](const Request& request) { return handler(backends, request); };
  return AnswerWith<Request>(handle, call, pool);
}
template <typename Request, typename Response>
ServerUnaryReactor* Answer(absl::StatusOr<Response> (*handler)(Backends&, const Request&,
                                                               const Principal&),
                           Backends& backends, const UnaryCall& call, WorkPool& pool) {
  const auto handle = [=, &backends, admission = call.admission](const Request& request) {
    return handler(backends, request, admission->caller().principal);
  };
  return AnswerWith<Request>(handle, call, pool);
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

grpc::ServerReadReactor<ByteBuffer>* LiquidBlendService::UploadAnimation(
    CallbackServerContext* context, ByteBuffer* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kUploadAnimation);
  if (!admission->verdict().ok()) {
    return Refuse<grpc::ServerReadReactor<ByteBuffer>>(*admission, admission->verdict());
  }
  return server::UploadAnimation(backends_, std::move(admission), context, response);
}

ServerUnaryReactor* LiquidBlendService::PresignUpload(CallbackServerContext* context,
                                                      const ByteBuffer* request,
                                                      ByteBuffer* response) {
  return Answer(server::PresignUpload, backends_,
                {context, interceptor_.Admit(*context, kPresignUpload), request, response},
                backends_.transfers);
}

ServerUnaryReactor* LiquidBlendService::PresignDownload(CallbackServerContext* context,
                                                        const ByteBuffer* request,
                                                        ByteBuffer* response) {
  return Answer(server::PresignDownload, backends_,
                {context, interceptor_.Admit(*context, kPresignDownload), request, response},
                backends_.transfers);
}

ServerUnaryReactor* LiquidBlendService::ImportAnimation(CallbackServerContext* context,
                                                        const ByteBuffer* request,
                                                        ByteBuffer* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kImportAnimation);
  auto asked = ReadRequest<v1::ImportAnimationRequest>(*admission, *request);
  if (!asked.ok()) return Refuse<ServerUnaryReactor>(*admission, asked.status());
  return server::ImportAnimation(backends_, std::move(admission), roots_, *std::move(asked),
                                 response);
}

ServerUnaryReactor* LiquidBlendService::GetAnimation(CallbackServerContext* context,
                                                     const ByteBuffer* request,
                                                     ByteBuffer* response) {
  return Answer(server::GetAnimation, backends_,
                {context, interceptor_.Admit(*context, kGetAnimation), request, response},
                backends_.io);
}

ServerUnaryReactor* LiquidBlendService::ListAnimations(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(server::ListAnimations, backends_,
                {context, interceptor_.Admit(*context, kListAnimations), request, response},
                backends_.io);
}

ServerUnaryReactor* LiquidBlendService::DeleteAnimation(CallbackServerContext* context,
                                                        const ByteBuffer* request,
                                                        ByteBuffer* response) {
  return Answer(server::DeleteAnimation, backends_,
                {context, interceptor_.Admit(*context, kDeleteAnimation), request, response},
                backends_.io);
}

ServerUnaryReactor* LiquidBlendService::RegisterFamily(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(server::RegisterFamily, backends_,
                {context, interceptor_.Admit(*context, kRegisterFamily), request, response},
                backends_.io);
}

ServerUnaryReactor* LiquidBlendService::GetFamily(CallbackServerContext* context,
                                                  const ByteBuffer* request, ByteBuffer* response) {
  return Answer(server::GetFamily, backends_,
                {context, interceptor_.Admit(*context, kGetFamily), request, response},
                backends_.io);
}

ServerUnaryReactor* LiquidBlendService::ListFamilies(CallbackServerContext* context,
                                                     const ByteBuffer* request,
                                                     ByteBuffer* response) {
  return Answer(server::ListFamilies, backends_,
                {context, interceptor_.Admit(*context, kListFamilies), request, response},
                backends_.io);
}

ServerUnaryReactor* LiquidBlendService::RollbackFamily(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(server::RollbackFamily, backends_,
                {context, interceptor_.Admit(*context, kRollbackFamily), request, response},
                backends_.io);
}

ServerUnaryReactor* LiquidBlendService::DeleteFamily(CallbackServerContext* context,
                                                     const ByteBuffer* request,
                                                     ByteBuffer* response) {
  return Answer(server::DeleteFamily, backends_,
                {context, interceptor_.Admit(*context, kDeleteFamily), request, response},
                backends_.io);
}

grpc::ServerWriteReactor<ByteBuffer>* LiquidBlendService::WatchOperation(
    CallbackServerContext* context, const ByteBuffer* request) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kWatchOperation);
  const auto asked = ReadRequest<v1::WatchOperationRequest>(*admission, *request);
  if (!asked.ok()) return Refuse<grpc::ServerWriteReactor<ByteBuffer>>(*admission, asked.status());
  return server::WatchOperation(backends_, std::move(admission), *asked);
}

ServerUnaryReactor* LiquidBlendService::GetFrame(CallbackServerContext* context,
                                                 const ByteBuffer* request, ByteBuffer* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kGetFrame);
  if (!admission->verdict().ok())
    return Refuse<ServerUnaryReactor>(*admission, admission->verdict());
  return AnswerFrame(backends_, std::move(admission), request, response);
}

grpc::ServerBidiReactor<ByteBuffer, ByteBuffer>* LiquidBlendService::StreamFrames(
    CallbackServerContext* context) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kStreamFrames);
  if (!admission->verdict().ok()) {
    return Refuse<grpc::ServerBidiReactor<ByteBuffer, ByteBuffer>>(*admission,
                                                                   admission->verdict());
  }
  return server::StreamFrames(backends_, std::move(admission));
}

ServerUnaryReactor* OperationsService::ListOperations(CallbackServerContext* context,
                                                      const ByteBuffer* request,
                                                      ByteBuffer* response) {
  return Answer(server::ListOperations, backends_,
                {context, interceptor_.Admit(*context, kListOperations), request, response},
                backends_.io);
}

ServerUnaryReactor* OperationsService::GetOperation(CallbackServerContext* context,
                                                    const ByteBuffer* request,
                                                    ByteBuffer* response) {
  return Answer(server::GetOperation, backends_,
                {context, interceptor_.Admit(*context, kGetOperation), request, response},
                backends_.io);
}

ServerUnaryReactor* OperationsService::DeleteOperation(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(server::DeleteOperation, backends_,
                {context, interceptor_.Admit(*context, kDeleteOperation), request, response},
                backends_.io);
}

ServerUnaryReactor* OperationsService::CancelOperation(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(server::CancelOperation, backends_,
                {context, interceptor_.Admit(*context, kCancelOperation), request, response},
                backends_.io);
}

ServerUnaryReactor* OperationsService::WaitOperation(CallbackServerContext* context,
                                                     const ByteBuffer* request,
                                                     ByteBuffer* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kWaitOperation);
  const auto asked = ReadRequest<lro::WaitOperationRequest>(*admission, *request);
  if (!asked.ok()) return Refuse<ServerUnaryReactor>(*admission, asked.status());
  return server::WaitOperation(backends_, std::move(admission), *asked, response);
}

}  // namespace liquidblend::server

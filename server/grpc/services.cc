#include "server/grpc/services.h"

#include <chrono>
#include <memory>
#include <utility>

#include "core/base/status_macros.h"
#include "google/longrunning/operations.pb.h"
#include "server/api/unary_methods.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/grpc/held_answer.h"
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
  const ByteBuffer* request;
  ByteBuffer* response;
};

class UnaryReactor final : public ServerUnaryReactor {
 public:
  explicit UnaryReactor(std::shared_ptr<Admission> admission) : admission_(std::move(admission)) {}

  void End(const absl::Status& status) { Finish(admission_->End(status)); }
  void OnDone() override {
    admission_->OnDone();
    delete this;
  }

 private:
  const std::shared_ptr<Admission> admission_;
};

// Lets the method's pool answer the call and end the reactor, unless this fails. The request is
// parsed there, since one of 4 MiB may take 150 MiB as a message.
absl::Status BeginAnswer(Backends& backends, const UnaryMethod& method,
                         const std::shared_ptr<Admission>& admission, const UnaryCall& call,
                         UnaryReactor* reactor) {
  LB_RETURN_IF_ERROR(admission->verdict());
  return (backends.*method.pool).Post([=, &backends, &method] {
    const absl::Status status = Guarded([&]() -> absl::Status {
      LB_RETURN_IF_ERROR(CheckIsWanted(*call.context));
      const MessagePtr request = method.new_request();
      LB_RETURN_IF_ERROR(admission->Read(*call.request, *request));
      const Caller& caller = admission->caller();
      LB_ASSIGN_OR_RETURN(const MessagePtr response, method.handle(backends, *request, caller));
      LB_ASSIGN_OR_RETURN(
          *call.response,
          HoldAnswer(backends, admission,
                     std::make_shared<const std::string>(response->SerializeAsString())));
      return absl::OkStatus();
    });
    reactor->End(status);
  });
}

// Answers a call of a method of FindUnaryMethod()'s table.
ServerUnaryReactor* Answer(Backends& backends, CallInterceptor& interceptor, const Method& method,
                           const UnaryCall& call) {
  const std::shared_ptr<Admission> admission = interceptor.Admit(*call.context, method);
  UnaryReactor* const reactor = std::make_unique<UnaryReactor>(admission).release();
  const absl::Status begun = Guarded([&] {
    return BeginAnswer(backends, *FindUnaryMethod(method.name), admission, call, reactor);
  });
  if (!begun.ok()) reactor->End(begun);
  return reactor;
}

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
  return Answer(backends_, interceptor_, kPresignUpload, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::PresignDownload(CallbackServerContext* context,
                                                        const ByteBuffer* request,
                                                        ByteBuffer* response) {
  return Answer(backends_, interceptor_, kPresignDownload, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::ReadFile(CallbackServerContext* context,
                                                 const ByteBuffer* request, ByteBuffer* response) {
  return Answer(backends_, interceptor_, kReadFile, {context, request, response});
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
  return Answer(backends_, interceptor_, kGetAnimation, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::GetAnimationFrame(CallbackServerContext* context,
                                                          const ByteBuffer* request,
                                                          ByteBuffer* response) {
  return Answer(backends_, interceptor_, kGetAnimationFrame, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::ListAnimations(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(backends_, interceptor_, kListAnimations, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::DeleteAnimation(CallbackServerContext* context,
                                                        const ByteBuffer* request,
                                                        ByteBuffer* response) {
  return Answer(backends_, interceptor_, kDeleteAnimation, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::RegisterFamily(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(backends_, interceptor_, kRegisterFamily, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::GetFamily(CallbackServerContext* context,
                                                  const ByteBuffer* request, ByteBuffer* response) {
  return Answer(backends_, interceptor_, kGetFamily, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::ListFamilies(CallbackServerContext* context,
                                                     const ByteBuffer* request,
                                                     ByteBuffer* response) {
  return Answer(backends_, interceptor_, kListFamilies, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::RollbackFamily(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(backends_, interceptor_, kRollbackFamily, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::DeleteFamily(CallbackServerContext* context,
                                                     const ByteBuffer* request,
                                                     ByteBuffer* response) {
  return Answer(backends_, interceptor_, kDeleteFamily, {context, request, response});
}

ServerUnaryReactor* LiquidBlendService::MeasureCorrespondences(CallbackServerContext* context,
                                                               const ByteBuffer* request,
                                                               ByteBuffer* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kMeasureCorrespondences);
  auto asked = ReadRequest<v1::MeasureCorrespondencesRequest>(*admission, *request);
  if (!asked.ok()) return Refuse<ServerUnaryReactor>(*admission, asked.status());
  return server::MeasureCorrespondences(backends_, std::move(admission), *std::move(asked),
                                        response);
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
  return Answer(backends_, interceptor_, kListOperations, {context, request, response});
}

ServerUnaryReactor* OperationsService::GetOperation(CallbackServerContext* context,
                                                    const ByteBuffer* request,
                                                    ByteBuffer* response) {
  return Answer(backends_, interceptor_, kGetOperation, {context, request, response});
}

ServerUnaryReactor* OperationsService::DeleteOperation(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(backends_, interceptor_, kDeleteOperation, {context, request, response});
}

ServerUnaryReactor* OperationsService::CancelOperation(CallbackServerContext* context,
                                                       const ByteBuffer* request,
                                                       ByteBuffer* response) {
  return Answer(backends_, interceptor_, kCancelOperation, {context, request, response});
}

ServerUnaryReactor* OperationsService::WaitOperation(CallbackServerContext* context,
                                                     const ByteBuffer* request,
                                                     ByteBuffer* response) {
  std::shared_ptr<Admission> admission = interceptor_.Admit(*context, kWaitOperation);
  const auto asked = ReadRequest<google::longrunning::WaitOperationRequest>(*admission, *request);
  if (!asked.ok()) return Refuse<ServerUnaryReactor>(*admission, asked.status());
  return server::WaitOperation(backends_, std::move(admission), *asked, response);
}

}  // namespace liquidblend::server

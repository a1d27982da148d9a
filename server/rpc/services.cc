#include "server/rpc/services.h"

#include <chrono>
#include <utility>

#include "core/base/status_macros.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/guarded.h"
#include "server/rpc/handlers.h"
#include "server/rpc/streaming.h"

namespace liquidblend::rpc {
namespace {

// Nobody waits for the answer to such a call any more.
absl::Status CheckIsWanted(const CallbackServerContext& context) {
  if (context.IsCancelled()) return absl::CancelledError("the client has cancelled the call");
  if (context.deadline() < std::chrono::system_clock::now()) {
    return absl::DeadlineExceededError("the deadline passed before the call's turn came");
  }
  return absl::OkStatus();
}

// Answers one call on the pool.
template <typename Request, typename Response>
ServerUnaryReactor* Answer(CallbackServerContext* context, Backends& backends, WorkPool& pool,
                           absl::StatusOr<Response> (*handle)(Backends&, const Request&),
                           const Request* request, Response* response) {
  ServerUnaryReactor* const reactor = context->DefaultReactor();
  const absl::Status accepted = pool.Post([=, &backends] {
    const absl::Status status = Guarded([&]() -> absl::Status {
      LB_RETURN_IF_ERROR(CheckIsWanted(*context));
      LB_ASSIGN_OR_RETURN(*response, handle(backends, *request));
      return absl::OkStatus();
    });
    reactor->Finish(ToGrpcStatus(status));
  });
  if (!accepted.ok()) reactor->Finish(ToGrpcStatus(accepted));
  return reactor;
}

}  // namespace

grpc::ServerReadReactor<v1::UploadAnimationRequest>* LiquidBlendService::UploadAnimation(
    CallbackServerContext* context, lro::Operation* response) {
  return rpc::UploadAnimation(backends_, calls_, context, response);
}

ServerUnaryReactor* LiquidBlendService::GetAnimation(CallbackServerContext* context,
                                                     const v1::GetAnimationRequest* request,
                                                     v1::Animation* response) {
  return Answer(context, backends_, backends_.io, rpc::GetAnimation, request, response);
}

ServerUnaryReactor* LiquidBlendService::ListAnimations(CallbackServerContext* context,
                                                       const v1::ListAnimationsRequest* request,
                                                       v1::ListAnimationsResponse* response) {
  return Answer(context, backends_, backends_.io, rpc::ListAnimations, request, response);
}

ServerUnaryReactor* LiquidBlendService::DeleteAnimation(CallbackServerContext* context,
                                                        const v1::DeleteAnimationRequest* request,
                                                        Empty* response) {
  return Answer(context, backends_, backends_.io, rpc::DeleteAnimation, request, response);
}

ServerUnaryReactor* LiquidBlendService::RegisterFamily(CallbackServerContext* context,
                                                       const v1::RegisterFamilyRequest* request,
                                                       lro::Operation* response) {
  return Answer(context, backends_, backends_.io, rpc::RegisterFamily, request, response);
}

ServerUnaryReactor* LiquidBlendService::GetFamily(CallbackServerContext* context,
                                                  const v1::GetFamilyRequest* request,
                                                  v1::Family* response) {
  return Answer(context, backends_, backends_.io, rpc::GetFamily, request, response);
}

ServerUnaryReactor* LiquidBlendService::ListFamilies(CallbackServerContext* context,
                                                     const v1::ListFamiliesRequest* request,
                                                     v1::ListFamiliesResponse* response) {
  return Answer(context, backends_, backends_.io, rpc::ListFamilies, request, response);
}

ServerUnaryReactor* LiquidBlendService::DeleteFamily(CallbackServerContext* context,
                                                     const v1::DeleteFamilyRequest* request,
                                                     Empty* response) {
  return Answer(context, backends_, backends_.io, rpc::DeleteFamily, request, response);
}

grpc::ServerWriteReactor<lro::Operation>* LiquidBlendService::WatchOperation(
    CallbackServerContext*, const v1::WatchOperationRequest* request) {
  return rpc::WatchOperation(backends_, calls_, request);
}

ServerUnaryReactor* LiquidBlendService::GetFrame(CallbackServerContext* context,
                                                 const v1::GetFrameRequest* request,
                                                 v1::Frame* response) {
  return Answer(context, backends_, backends_.frames, rpc::GetFrame, request, response);
}

grpc::ServerBidiReactor<v1::StreamFramesRequest, v1::StreamFramesResponse>*
LiquidBlendService::StreamFrames(CallbackServerContext*) {
  return rpc::StreamFrames(backends_, calls_);
}

ServerUnaryReactor* OperationsService::ListOperations(CallbackServerContext* context,
                                                      const lro::ListOperationsRequest* request,
                                                      lro::ListOperationsResponse* response) {
  return Answer(context, backends_, backends_.io, rpc::ListOperations, request, response);
}

ServerUnaryReactor* OperationsService::GetOperation(CallbackServerContext* context,
                                                    const lro::GetOperationRequest* request,
                                                    lro::Operation* response) {
  return Answer(context, backends_, backends_.io, rpc::GetOperation, request, response);
}

ServerUnaryReactor* OperationsService::DeleteOperation(CallbackServerContext* context,
                                                       const lro::DeleteOperationRequest* request,
                                                       Empty* response) {
  return Answer(context, backends_, backends_.io, rpc::DeleteOperation, request, response);
}

ServerUnaryReactor* OperationsService::CancelOperation(CallbackServerContext* context,
                                                       const lro::CancelOperationRequest* request,
                                                       Empty* response) {
  return Answer(context, backends_, backends_.io, rpc::CancelOperation, request, response);
}

ServerUnaryReactor* OperationsService::WaitOperation(CallbackServerContext*,
                                                     const lro::WaitOperationRequest* request,
                                                     lro::Operation* response) {
  return rpc::WaitOperation(backends_, calls_, request, response);
}

}  // namespace liquidblend::rpc

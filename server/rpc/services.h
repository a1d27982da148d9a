// The gRPC services: each method leads to its handler, and does nothing itself.
#pragma once

#include "google/longrunning/operations.grpc.pb.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "server/rpc/backends.h"
#include "server/rpc/call.h"

namespace liquidblend::rpc {

using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

class LiquidBlendService final : public v1::LiquidBlend::CallbackService {
 public:
  LiquidBlendService(Backends& backends, OpenCalls& calls) : backends_(backends), calls_(calls) {}

  grpc::ServerReadReactor<v1::UploadAnimationRequest>* UploadAnimation(
      CallbackServerContext* context, google::longrunning::Operation* response) override;
  ServerUnaryReactor* GetAnimation(CallbackServerContext* context,
                                   const v1::GetAnimationRequest* request,
                                   v1::Animation* response) override;
  ServerUnaryReactor* ListAnimations(CallbackServerContext* context,
                                     const v1::ListAnimationsRequest* request,
                                     v1::ListAnimationsResponse* response) override;
  ServerUnaryReactor* DeleteAnimation(CallbackServerContext* context,
                                      const v1::DeleteAnimationRequest* request,
                                      google::protobuf::Empty* response) override;
  ServerUnaryReactor* RegisterFamily(CallbackServerContext* context,
                                     const v1::RegisterFamilyRequest* request,
                                     google::longrunning::Operation* response) override;
  ServerUnaryReactor* GetFamily(CallbackServerContext* context, const v1::GetFamilyRequest* request,
                                v1::Family* response) override;
  ServerUnaryReactor* ListFamilies(CallbackServerContext* context,
                                   const v1::ListFamiliesRequest* request,
                                   v1::ListFamiliesResponse* response) override;
  ServerUnaryReactor* DeleteFamily(CallbackServerContext* context,
                                   const v1::DeleteFamilyRequest* request,
                                   google::protobuf::Empty* response) override;
  grpc::ServerWriteReactor<google::longrunning::Operation>* WatchOperation(
      CallbackServerContext* context, const v1::WatchOperationRequest* request) override;
  ServerUnaryReactor* GetFrame(CallbackServerContext* context, const v1::GetFrameRequest* request,
                               v1::Frame* response) override;
  grpc::ServerBidiReactor<v1::StreamFramesRequest, v1::StreamFramesResponse>* StreamFrames(
      CallbackServerContext* context) override;

 private:
  Backends& backends_;
  OpenCalls& calls_;
};

class OperationsService final : public google::longrunning::Operations::CallbackService {
 public:
  OperationsService(Backends& backends, OpenCalls& calls) : backends_(backends), calls_(calls) {}

  ServerUnaryReactor* ListOperations(
      CallbackServerContext* context, const google::longrunning::ListOperationsRequest* request,
      google::longrunning::ListOperationsResponse* response) override;
  ServerUnaryReactor* GetOperation(CallbackServerContext* context,
                                   const google::longrunning::GetOperationRequest* request,
                                   google::longrunning::Operation* response) override;
  ServerUnaryReactor* DeleteOperation(CallbackServerContext* context,
                                      const google::longrunning::DeleteOperationRequest* request,
                                      google::protobuf::Empty* response) override;
  ServerUnaryReactor* CancelOperation(CallbackServerContext* context,
                                      const google::longrunning::CancelOperationRequest* request,
                                      google::protobuf::Empty* response) override;
  ServerUnaryReactor* WaitOperation(CallbackServerContext* context,
                                    const google::longrunning::WaitOperationRequest* request,
                                    google::longrunning::Operation* response) override;

 private:
  Backends& backends_;
  OpenCalls& calls_;
};

}  // namespace liquidblend::rpc

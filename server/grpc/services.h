// The gRPC services: each method only calls its handler.
#pragma once

#include "google/longrunning/operations.grpc.pb.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "server/api/import_source.h"
#include "server/frames/backends.h"
#include "server/grpc/admission.h"

namespace liquidblend::server {

using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

// The methods whose messages gRPC reads and writes: all but those for frames and uploads, which are
// answered in bytes (see AnswerFrame and UploadAnimation).
using v1::LiquidBlend;
using MethodsInMessages = LiquidBlend::WithCallbackMethod_PresignUpload<
    LiquidBlend::WithCallbackMethod_PresignDownload<LiquidBlend::WithCallbackMethod_ImportAnimation<
        LiquidBlend::WithCallbackMethod_GetAnimation<LiquidBlend::WithCallbackMethod_ListAnimations<
            LiquidBlend::WithCallbackMethod_DeleteAnimation<
                LiquidBlend::WithCallbackMethod_RegisterFamily<
                    LiquidBlend::WithCallbackMethod_GetFamily<
                        LiquidBlend::WithCallbackMethod_ListFamilies<
                            LiquidBlend::WithCallbackMethod_RollbackFamily<
                                LiquidBlend::WithCallbackMethod_DeleteFamily<
                                    LiquidBlend::WithCallbackMethod_WatchOperation<
                                        LiquidBlend::Service>>>>>>>>>>>>;
using AllMethods =
    LiquidBlend::WithRawCallbackMethod_UploadAnimation<LiquidBlend::WithRawCallbackMethod_GetFrame<
        LiquidBlend::WithRawCallbackMethod_StreamFrames<MethodsInMessages>>>;

class LiquidBlendService final : public AllMethods {
 public:
  LiquidBlendService(Backends& backends, CallInterceptor& interceptor, const ImportRoots& roots)
      : backends_(backends), interceptor_(interceptor), roots_(roots) {}

  grpc::ServerReadReactor<grpc::ByteBuffer>* UploadAnimation(CallbackServerContext* context,
                                                             grpc::ByteBuffer* response) override;
  ServerUnaryReactor* PresignUpload(CallbackServerContext* context,
                                    const v1::PresignUploadRequest* request,
                                    v1::PresignUploadResponse* response) override;
  ServerUnaryReactor* PresignDownload(CallbackServerContext* context,
                                      const v1::PresignDownloadRequest* request,
                                      v1::PresignDownloadResponse* response) override;
  ServerUnaryReactor* ImportAnimation(CallbackServerContext* context,
                                      const v1::ImportAnimationRequest* request,
                                      google::longrunning::Operation* response) override;
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
  ServerUnaryReactor* RollbackFamily(CallbackServerContext* context,
                                     const v1::RollbackFamilyRequest* request,
                                     v1::Family* response) override;
  ServerUnaryReactor* DeleteFamily(CallbackServerContext* context,
                                   const v1::DeleteFamilyRequest* request,
                                   google::protobuf::Empty* response) override;
  grpc::ServerWriteReactor<google::longrunning::Operation>* WatchOperation(
      CallbackServerContext* context, const v1::WatchOperationRequest* request) override;
  ServerUnaryReactor* GetFrame(CallbackServerContext* context, const grpc::ByteBuffer* request,
                               grpc::ByteBuffer* response) override;
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* StreamFrames(
      CallbackServerContext* context) override;

 private:
  Backends& backends_;
  CallInterceptor& interceptor_;
  const ImportRoots& roots_;
};

class OperationsService final : public google::longrunning::Operations::CallbackService {
 public:
  OperationsService(Backends& backends, CallInterceptor& interceptor)
      : backends_(backends), interceptor_(interceptor) {}

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
  CallInterceptor& interceptor_;
};

}  // namespace liquidblend::server

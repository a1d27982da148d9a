// The gRPC services: each method only calls its handler.
#pragma once

#include "google/longrunning/operations.grpc.pb.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "server/api/import_source.h"
#include "server/frames/backends.h"
#include "server/grpc/admission.h"

namespace liquidblend::server {

using grpc::ByteBuffer;
using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

// All methods take and give bytes. Where gRPC parses requests and writes answers, an allocation
// that fails ends the server.
using v1::LiquidBlend;
using LiquidBlendMethods = LiquidBlend::WithRawCallbackMethod_GetAnimationFrame<
    LiquidBlend::WithRawCallbackMethod_MeasureCorrespondences<
        LiquidBlend::WithRawCallbackMethod_UploadAnimation<LiquidBlend::WithRawCallbackMethod_PresignUpload<
            LiquidBlend::WithRawCallbackMethod_PresignDownload<LiquidBlend::WithRawCallbackMethod_ReadFile<
                LiquidBlend::WithRawCallbackMethod_ImportAnimation<
                    LiquidBlend::WithRawCallbackMethod_GetAnimation<
                        LiquidBlend::WithRawCallbackMethod_ListAnimations<
                            LiquidBlend::WithRawCallbackMethod_DeleteAnimation<
                                LiquidBlend::WithRawCallbackMethod_RegisterFamily<
                                    LiquidBlend::WithRawCallbackMethod_GetFamily<
                                        LiquidBlend::WithRawCallbackMethod_ListFamilies<
                                            LiquidBlend::WithRawCallbackMethod_RollbackFamily<
                                                LiquidBlend::WithRawCallbackMethod_DeleteFamily<
                                                    LiquidBlend::WithRawCallbackMethod_WatchOperation<
                                                        LiquidBlend::WithRawCallbackMethod_GetFrame<
                                                            LiquidBlend::
                                                                WithRawCallbackMethod_StreamFrames<
                                                                    LiquidBlend::
                                                                        Service>>>>>>>>>>>>>>>>>>;

using google::longrunning::Operations;
using OperationsMethods =
    Operations::WithRawCallbackMethod_ListOperations<Operations::WithRawCallbackMethod_GetOperation<
        Operations::WithRawCallbackMethod_DeleteOperation<
            Operations::WithRawCallbackMethod_CancelOperation<
                Operations::WithRawCallbackMethod_WaitOperation<Operations::Service>>>>>;

class LiquidBlendService final : public LiquidBlendMethods {
 public:
  LiquidBlendService(Backends& backends, CallInterceptor& interceptor, const ImportRoots& roots)
      : backends_(backends), interceptor_(interceptor), roots_(roots) {}

  grpc::ServerReadReactor<ByteBuffer>* UploadAnimation(CallbackServerContext* context,
                                                       ByteBuffer* response) override;
  ServerUnaryReactor* PresignUpload(CallbackServerContext* context, const ByteBuffer* request,
                                    ByteBuffer* response) override;
  ServerUnaryReactor* PresignDownload(CallbackServerContext* context, const ByteBuffer* request,
                                      ByteBuffer* response) override;
  ServerUnaryReactor* ReadFile(CallbackServerContext* context, const ByteBuffer* request,
                               ByteBuffer* response) override;
  ServerUnaryReactor* ImportAnimation(CallbackServerContext* context, const ByteBuffer* request,
                                      ByteBuffer* response) override;
  ServerUnaryReactor* GetAnimation(CallbackServerContext* context, const ByteBuffer* request,
                                   ByteBuffer* response) override;
  ServerUnaryReactor* GetAnimationFrame(CallbackServerContext* context, const ByteBuffer* request,
                                        ByteBuffer* response) override;
  ServerUnaryReactor* ListAnimations(CallbackServerContext* context, const ByteBuffer* request,
                                     ByteBuffer* response) override;
  ServerUnaryReactor* DeleteAnimation(CallbackServerContext* context, const ByteBuffer* request,
                                      ByteBuffer* response) override;
  ServerUnaryReactor* RegisterFamily(CallbackServerContext* context, const ByteBuffer* request,
                                     ByteBuffer* response) override;
  ServerUnaryReactor* GetFamily(CallbackServerContext* context, const ByteBuffer* request,
                                ByteBuffer* response) override;
  ServerUnaryReactor* ListFamilies(CallbackServerContext* context, const ByteBuffer* request,
                                   ByteBuffer* response) override;
  ServerUnaryReactor* RollbackFamily(CallbackServerContext* context, const ByteBuffer* request,
                                     ByteBuffer* response) override;
  ServerUnaryReactor* DeleteFamily(CallbackServerContext* context, const ByteBuffer* request,
                                   ByteBuffer* response) override;
  ServerUnaryReactor* MeasureCorrespondences(CallbackServerContext* context,
                                             const ByteBuffer* request,
                                             ByteBuffer* response) override;
  grpc::ServerWriteReactor<ByteBuffer>* WatchOperation(CallbackServerContext* context,
                                                       const ByteBuffer* request) override;
  ServerUnaryReactor* GetFrame(CallbackServerContext* context, const ByteBuffer* request,
                               ByteBuffer* response) override;
  grpc::ServerBidiReactor<ByteBuffer, ByteBuffer>* StreamFrames(
      CallbackServerContext* context) override;

 private:
  Backends& backends_;
  CallInterceptor& interceptor_;
  const ImportRoots& roots_;
};

class OperationsService final : public OperationsMethods {
 public:
  OperationsService(Backends& backends, CallInterceptor& interceptor)
      : backends_(backends), interceptor_(interceptor) {}

  ServerUnaryReactor* ListOperations(CallbackServerContext* context, const ByteBuffer* request,
                                     ByteBuffer* response) override;
  ServerUnaryReactor* GetOperation(CallbackServerContext* context, const ByteBuffer* request,
                                   ByteBuffer* response) override;
  ServerUnaryReactor* DeleteOperation(CallbackServerContext* context, const ByteBuffer* request,
                                      ByteBuffer* response) override;
  ServerUnaryReactor* CancelOperation(CallbackServerContext* context, const ByteBuffer* request,
                                      ByteBuffer* response) override;
  ServerUnaryReactor* WaitOperation(CallbackServerContext* context, const ByteBuffer* request,
                                    ByteBuffer* response) override;

 private:
  Backends& backends_;
  CallInterceptor& interceptor_;
};

}  // namespace liquidblend::server

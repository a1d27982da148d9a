// The methods that stream or wait, each in the file of its name. They never block a gRPC thread:
// every step runs on a WorkPool.
#pragma once

#include <grpcpp/grpcpp.h>

#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/rpc/backends.h"
#include "server/rpc/call.h"

namespace liquidblend::rpc {

// One chunk at a time goes from the client to the disk. Nothing is visible before the client has
// half-closed; a client that goes away, or an error, leaves nothing visible.
grpc::ServerReadReactor<v1::UploadAnimationRequest>* UploadAnimation(
    Backends& backends, OpenCalls& calls, grpc::CallbackServerContext* context,
    google::longrunning::Operation* response);

// Looks at the job every limits.watch_interval, and writes the operation when it has changed.
grpc::ServerWriteReactor<google::longrunning::Operation>* WatchOperation(
    Backends& backends, OpenCalls& calls, const v1::WatchOperationRequest* request);

// Answers when the job is done, or with its state when the timeout is over (none given: until the
// call's deadline, which ends it with DEADLINE_EXCEEDED).
grpc::ServerUnaryReactor* WaitOperation(Backends& backends, OpenCalls& calls,
                                        const google::longrunning::WaitOperationRequest* request,
                                        google::longrunning::Operation* response);

// The newest values of all requests so far count from the next frame on. One frame is made or
// written at a time, so a slow client holds up nobody, and what became late meanwhile is skipped.
grpc::ServerBidiReactor<v1::StreamFramesRequest, v1::StreamFramesResponse>* StreamFrames(
    Backends& backends, OpenCalls& calls);

}  // namespace liquidblend::rpc

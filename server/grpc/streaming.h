// Handlers of the methods that stream or wait, each in the file of its name. They never block a
// gRPC thread: every step runs on a WorkPool. `admission` is of the admitted call.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>

#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/api/import_source.h"
#include "server/frames/backends.h"
#include "server/grpc/admission.h"

namespace liquidblend::server {

// One chunk at a time goes from the client to the disk. Nothing is visible before the client has
// half-closed; a client that goes away, or an error, leaves nothing visible. Reads bytes, not
// messages, as gRPC takes a message that does not parse for the end of the stream.
grpc::ServerReadReactor<grpc::ByteBuffer>* UploadAnimation(Backends& backends,
                                                           std::shared_ptr<Admission> admission,
                                                           grpc::CallbackServerContext* context,
                                                           grpc::ByteBuffer* response);

// Copies the files at the location, chunk by chunk, before it answers. `roots` outlive the call.
grpc::ServerUnaryReactor* ImportAnimation(Backends& backends, std::shared_ptr<Admission> admission,
                                          const ImportRoots& roots,
                                          v1::ImportAnimationRequest request,
                                          grpc::ByteBuffer* response);

// Measures slice by slice, before it answers.
grpc::ServerUnaryReactor* MeasureCorrespondences(Backends& backends,
                                                 std::shared_ptr<Admission> admission,
                                                 v1::MeasureCorrespondencesRequest request,
                                                 grpc::ByteBuffer* response);

// Looks at the job every limits.watch_interval, less often while many are watched, and writes the
// operation when it has changed. All calls for one operation share a look (operation_looks.h).
grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchOperation(
    Backends& backends, std::shared_ptr<Admission> admission,
    const v1::WatchOperationRequest& request);

// Answers when the job is done, or with its state when the timeout is over (none given: until the
// call's deadline, which ends it with DEADLINE_EXCEEDED).
grpc::ServerUnaryReactor* WaitOperation(Backends& backends, std::shared_ptr<Admission> admission,
                                        const google::longrunning::WaitOperationRequest& request,
                                        grpc::ByteBuffer* response);

// Sends the cached bytes of the frame, without copying or serialising them.
grpc::ServerUnaryReactor* AnswerFrame(Backends& backends, std::shared_ptr<Admission> admission,
                                      const grpc::ByteBuffer* request, grpc::ByteBuffer* response);

// The newest values of all requests so far count from the next frame on. One frame is written at a
// time, so a slow client delays nobody, and late frames are skipped. Frames go out as
// AnswerFrame's.
grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* StreamFrames(
    Backends& backends, std::shared_ptr<Admission> admission);

}  // namespace liquidblend::server

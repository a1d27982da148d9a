// Messages as gRPC's byte buffers.
#pragma once

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "google/protobuf/message.h"
#include "server/base/errors.h"
#include "server/frames/frame_stream.h"
#include "server/frames/unread_answers.h"

namespace liquidblend::server {

// Both refer to the bytes and keep them alive; nothing is copied.
grpc::ByteBuffer ToByteBuffer(const AnswerPtr& answer);        // a message
grpc::ByteBuffer ToByteBuffer(const StreamedFrame& streamed);  // a v1::StreamFramesResponse

// A request of at most max_bytes, without its unknown fields.
// Errors: kInvalidArgument, naming the method, if the bytes are too many or do not parse.
absl::Status Parse(const grpc::ByteBuffer& bytes, absl::string_view method,
                   google::protobuf::Message& message, int64_t max_bytes = kMaxSmallRequestBytes);

}  // namespace liquidblend::server

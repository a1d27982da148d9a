#include "server/grpc/byte_buffers.h"

#include <grpcpp/support/proto_buffer_reader.h>

#include <utility>

namespace liquidblend::server {
namespace {

grpc::Slice SliceOf(const AnswerPtr& answer) {
  const auto let_go = [](void* held) { delete static_cast<AnswerPtr*>(held); };
  return grpc::Slice(const_cast<char*>(answer->data()), answer->size(), let_go,
                     new AnswerPtr(answer));
}

}  // namespace

grpc::ByteBuffer ToByteBuffer(const AnswerPtr& answer) {
  const grpc::Slice slice = SliceOf(answer);
  return grpc::ByteBuffer(&slice, 1);
}

grpc::ByteBuffer ToByteBuffer(const StreamedFrame& streamed) {
  const grpc::Slice slices[] = {grpc::Slice(ResponsePrefix(streamed)), SliceOf(streamed.frame)};
  return grpc::ByteBuffer(slices, 2);
}

absl::Status Parse(const grpc::ByteBuffer& bytes, absl::string_view method,
                   google::protobuf::Message& message, int64_t max_bytes) {
  const auto size_bytes = static_cast<int64_t>(bytes.Length());
  if (size_bytes > max_bytes) return RequestTooLarge(method, size_bytes, max_bytes);
  grpc::ByteBuffer shared = bytes;  // the reader wants one that it may change
  grpc::ProtoBufferReader reader(&shared);
  if (!reader.status().ok() || !message.ParseFromZeroCopyStream(&reader)) {
    return MalformedRequest(method);
  }
  message.DiscardUnknownFields();
  return absl::OkStatus();
}

}  // namespace liquidblend::server

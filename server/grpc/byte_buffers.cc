#include "server/grpc/byte_buffers.h"

#include <grpcpp/support/proto_buffer_reader.h>

#include <utility>

namespace liquidblend::server {
namespace {

grpc::Slice SliceOf(const FramePtr& frame) {
  const auto let_go = [](void* held) { delete static_cast<FramePtr*>(held); };
  return grpc::Slice(const_cast<char*>(frame->data()), frame->size(), let_go, new FramePtr(frame));
}

}  // namespace

grpc::ByteBuffer ToByteBuffer(std::string bytes) {
  const auto let_go = [](void* held) { delete static_cast<std::string*>(held); };
  const auto held = new std::string(std::move(bytes));
  const grpc::Slice slice(held->data(), held->size(), let_go, held);
  return grpc::ByteBuffer(&slice, 1);
}

grpc::ByteBuffer ToByteBuffer(const FramePtr& frame) {
  const grpc::Slice slice = SliceOf(frame);
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

// A call with one request and one answer whose method takes several steps on the server's pools.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <utility>

#include "server/grpc/byte_buffers.h"
#include "server/grpc/call.h"

namespace liquidblend::server {

// A client that goes away ends the call.
//   Method  callable with (caller, is_wanted, done), the last arguments of ImportAnimation()
template <typename Method>
class SteppedCall final : public Call<grpc::ServerUnaryReactor> {
 public:
  SteppedCall(std::shared_ptr<Admission> admission, grpc::ByteBuffer* response, Method method)
      : Call(std::move(admission)), response_(response), method_(std::move(method)) {}

 private:
  void Begin() override {
    const auto self = shared_from_this();
    method_(
        caller(), [this, self] { return !has_ended(); },
        [this, self](const auto& answer) {
          if (!answer.ok()) return Close(answer.status());
          Attempt([&] { AnswerWith(*answer); });
        });
  }

  template <typename Response>
  void AnswerWith(const Response& response) {
    grpc::ByteBuffer bytes = ToByteBuffer(response.SerializeAsString());
    Answer([&] { response_->Swap(&bytes); });
  }

  grpc::ByteBuffer* const response_;
  Method method_;
};

template <typename Method>
grpc::ServerUnaryReactor* StartSteppedCall(std::shared_ptr<Admission> admission,
                                           grpc::ByteBuffer* response, Method method) {
  return Call<grpc::ServerUnaryReactor>::Start<SteppedCall<Method>>(std::move(admission), response,
                                                                    std::move(method));
}

}  // namespace liquidblend::server

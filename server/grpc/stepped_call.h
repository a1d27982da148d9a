// A call with one request and one answer whose method takes several steps on the server's pools.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <utility>

#include "server/frames/backends.h"
#include "server/grpc/call.h"

namespace liquidblend::server {

// A client that goes away ends the call.
//   Method  callable with (caller, is_wanted, done), the last arguments of ImportAnimation()
template <typename Method>
class SteppedCall final : public Call<grpc::ServerUnaryReactor> {
 public:
  SteppedCall(Backends& backends, std::shared_ptr<Admission> admission, grpc::ByteBuffer* response,
              Method method)
      : Call(std::move(admission)),
        backends_(backends),
        response_(response),
        method_(std::move(method)) {}

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
    auto bytes = Hold(backends_, std::make_shared<const std::string>(response.SerializeAsString()));
    if (!bytes.ok()) return Close(bytes.status());
    Answer([&] { response_->Swap(&*bytes); });
  }

  Backends& backends_;
  grpc::ByteBuffer* const response_;
  Method method_;
};

template <typename Method>
grpc::ServerUnaryReactor* StartSteppedCall(Backends& backends, std::shared_ptr<Admission> admission,
                                           grpc::ByteBuffer* response, Method method) {
  return Call<grpc::ServerUnaryReactor>::Start<SteppedCall<Method>>(backends, std::move(admission),
                                                                    response, std::move(method));
}

}  // namespace liquidblend::server

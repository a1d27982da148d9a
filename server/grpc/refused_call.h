// A refused call, which ends before it begins.
#pragma once

#include <grpcpp/grpcpp.h>

namespace liquidblend::server {

// Reactor: one of gRPC's server reactors.
template <typename Reactor>
class RefusedCall final : public Reactor {
 public:
  explicit RefusedCall(const grpc::Status& status) { this->Finish(status); }
  void OnDone() override { delete this; }
};

}  // namespace liquidblend::server

// What gRPC would answer by itself, and how: with an empty text and no details.
#pragma once

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/support/server_interceptor.h>

#include "server/access/call_log.h"

namespace liquidblend::server {

// Answers methods that no service has with UNIMPLEMENTED (METHOD_UNKNOWN).
class UnknownMethods final : public grpc::CallbackGenericService {
 public:
  explicit UnknownMethods(CallLog& log) : log_(log) {}
  grpc::ServerGenericBidiReactor* CreateReactor(
      grpc::GenericCallbackServerContext* context) override;

 private:
  CallLog& log_;
};

// Gives each error that leaves without details a google.rpc.ErrorInfo. A request that is no message
// of its method becomes INVALID_ARGUMENT (REQUEST_MALFORMED), where gRPC says UNIMPLEMENTED.
class ErrorCompleterFactory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit ErrorCompleterFactory(CallLog& log) : log_(log) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(
      grpc::experimental::ServerRpcInfo* info) override;

 private:
  CallLog& log_;
};

}  // namespace liquidblend::server

// Details of the errors that gRPC answers by itself, which would have an empty text and no details.
#pragma once

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/support/server_interceptor.h>

#include "absl/strings/string_view.h"
#include "server/access/call_log.h"

namespace liquidblend::server {

// Whether gRPC's own health service ends a Watch with this code because its client has left, which
// is no error: clients watch as long as they are connected.
bool IsLeftHealthWatch(absl::string_view path, grpc::StatusCode code);

// Answers unknown methods with UNIMPLEMENTED (METHOD_UNKNOWN).
class UnknownMethods final : public grpc::CallbackGenericService {
 public:
  explicit UnknownMethods(CallLog& log) : log_(log) {}
  grpc::ServerGenericBidiReactor* CreateReactor(
      grpc::GenericCallbackServerContext* context) override;

 private:
  CallLog& log_;
};

// Adds a google.rpc.ErrorInfo to each error without details. A request that gRPC itself cannot
// parse (health checks, reflection) becomes INVALID_ARGUMENT (REQUEST_MALFORMED), not
// UNIMPLEMENTED.
class ErrorCompleterFactory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit ErrorCompleterFactory(CallLog& log) : log_(log) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(
      grpc::experimental::ServerRpcInfo* info) override;

 private:
  CallLog& log_;
};

}  // namespace liquidblend::server

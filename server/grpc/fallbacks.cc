#include "server/grpc/fallbacks.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "server/base/errors.h"
#include "server/grpc/grpc_status.h"
#include "server/grpc/refused_call.h"

namespace liquidblend::server {
namespace {

namespace ex = grpc::experimental;

// The log line of a call that did not reach a CallInterceptor.
void Tell(CallLog& log, const std::string& method, const std::string& peer,
          const absl::Status& status) {
  EndedCall call;
  call.how = {{"method", method}, {"code", absl::StatusCodeToString(status.code())}};
  call.caller.client = peer;
  call.error = CleanText(status.message());
  log.Tell(call);
}

class ErrorCompleter final : public ex::Interceptor {
 public:
  ErrorCompleter(CallLog& log, ex::ServerRpcInfo& info)
      : log_(log), info_(info), method_(absl::string_view(info.method())) {
    method_.erase(0, method_.rfind('/') + 1);
  }

  void Intercept(ex::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(ex::InterceptionHookPoints::PRE_SEND_STATUS)) {
      Complete(*methods);
    }
    methods->Proceed();
  }

 private:
  void Complete(ex::InterceptorBatchMethods& methods) const {
    const grpc::Status status = methods.GetSendStatus();
    if (status.ok() || !status.error_details().empty()) return;
    if (IsLeftHealthWatch(info_.method(), status.error_code())) return;
    const bool is_malformed = status.error_code() == grpc::StatusCode::UNIMPLEMENTED;
    const absl::Status told = is_malformed
                                  ? MalformedRequest(method_)
                                  : absl::Status(static_cast<absl::StatusCode>(status.error_code()),
                                                 status.error_message());
    Tell(log_, method_, info_.server_context()->peer(), told);
    methods.ModifySendStatus(ToGrpcStatus(told));
  }

  CallLog& log_;
  ex::ServerRpcInfo& info_;  // lives as long as the call
  std::string method_;
};

}  // namespace

bool IsLeftHealthWatch(absl::string_view path, grpc::StatusCode code) {
  return path == "/grpc.health.v1.Health/Watch" && code == grpc::StatusCode::UNKNOWN;
}

grpc::ServerGenericBidiReactor* UnknownMethods::CreateReactor(
    grpc::GenericCallbackServerContext* context) {
  const std::string method = CleanText(context->method(), 80);
  const absl::Status refusal =
      WithReason(absl::UnimplementedError(absl::StrCat("there is no method ", method)),
                 "METHOD_UNKNOWN", {{"method", method}});
  Tell(log_, method, context->peer(), refusal);
  return new RefusedCall<grpc::ServerGenericBidiReactor>(ToGrpcStatus(refusal));
}

ex::Interceptor* ErrorCompleterFactory::CreateServerInterceptor(ex::ServerRpcInfo* info) {
  return new ErrorCompleter(log_, *info);
}

}  // namespace liquidblend::server

#include "server/grpc/count_calls.h"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"
#include "server/grpc/fallbacks.h"

namespace liquidblend::server {
namespace {

using google::protobuf::DescriptorPool;
using grpc::experimental::InterceptionHookPoints;

// gRPC keeps this service's descriptor to itself.
constexpr absl::string_view kHealth = "/grpc.health.v1.Health/";

// The method that a path names. Clients may send any path.
std::string MethodOf(absl::string_view path) {
  const std::string method(path.substr(path.rfind('/') + 1));
  if (absl::StartsWith(path, kHealth) && (method == "Check" || method == "Watch")) return method;
  const std::string name =
      absl::StrReplaceAll(path.substr(std::min<size_t>(1, path.size())), {{"/", "."}});
  return DescriptorPool::generated_pool()->FindMethodByName(name) != nullptr ? method : "other";
}

class CountCall final : public grpc::experimental::Interceptor {
 public:
  CountCall(metrics::Metrics& metrics, const char* path) : metrics_(metrics), path_(path) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using Hook = InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(Hook::PRE_SEND_MESSAGE)) write_.Lap();
    if (methods->QueryInterceptionHookPoint(Hook::POST_SEND_MESSAGE) && SendsFrames()) {
      metrics_.ObserveStage(metrics::Stage::kWrite, write_.Lap());
    }
    if (methods->QueryInterceptionHookPoint(Hook::PRE_SEND_STATUS)) {
      Count(methods->GetSendStatus().error_code());
    }
    methods->Proceed();
  }

 private:
  bool SendsFrames() const {
    return absl::EndsWith(path_, "/GetFrame") || absl::EndsWith(path_, "/StreamFrames");
  }

  void Count(grpc::StatusCode code) {
    if (IsLeftHealthWatch(path_, code)) code = grpc::StatusCode::CANCELLED;
    const std::string name = absl::StatusCodeToString(static_cast<absl::StatusCode>(code));
    metrics_.CountRequest({"grpc", MethodOf(path_), name, call_.Lap()});
  }

  metrics::Metrics& metrics_;
  const absl::string_view path_;  // "/package.Service/Method"; gRPC's own
  metrics::StopWatch call_;
  metrics::StopWatch write_;
};

class CountCallFactory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit CountCallFactory(metrics::Metrics& metrics) : metrics_(metrics) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(
      grpc::experimental::ServerRpcInfo* info) override {
    return new CountCall(metrics_, info->method());  // gRPC takes it
  }

 private:
  metrics::Metrics& metrics_;
};

}  // namespace

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> CountCalls(
    metrics::Metrics& metrics) {
  return std::make_unique<CountCallFactory>(metrics);
}

}  // namespace liquidblend::server

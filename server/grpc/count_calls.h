// Interceptor that counts every gRPC call of any service when it ends.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>
#include <vector>

#include "server/metrics/metrics.h"

namespace liquidblend::server {

using Interceptors =
    std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>>;

// Counts in `metrics`, which outlives the server, each call's method (unknown ones as "other"),
// code and duration, and the time that its frames took to go out.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> CountCalls(
    metrics::Metrics& metrics);

}  // namespace liquidblend::server

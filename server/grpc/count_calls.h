// Every gRPC call is counted when it ends, whichever service it is of.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>
#include <vector>

#include "server/metrics/metrics.h"

namespace liquidblend::server {

using Interceptors =
    std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>>;

// Tells `metrics`, which outlives the server, of each call's method (those that no service has are
// "other"), code and duration, and how long its frames took to go out.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> CountCalls(
    metrics::Metrics& metrics);

}  // namespace liquidblend::server

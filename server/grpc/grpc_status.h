// Conversion of absl::Status into grpc::Status. No other code converts.
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace liquidblend::server {

// Code, message and details of ToStatusDetails().
grpc::Status ToGrpcStatus(const absl::Status& status);

}  // namespace liquidblend::server

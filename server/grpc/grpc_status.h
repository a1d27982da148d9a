// The one place where absl::Status becomes grpc::Status.
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace liquidblend::server {

// Code, message and details of ToStatusDetails().
grpc::Status ToGrpcStatus(const absl::Status& status);

}  // namespace liquidblend::server

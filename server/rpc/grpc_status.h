// The one place where absl::Status becomes grpc::Status.
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace liquidblend::rpc {

// Code and message as they are; details: the field violations if there are any, and always a
// google.rpc.ErrorInfo (domain "liquidblend"; reason: WithReason()'s, or the code's name).
grpc::Status ToGrpcStatus(const absl::Status& status);

}  // namespace liquidblend::rpc

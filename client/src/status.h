// Conversion of grpc::Status and google.rpc.Status into absl::Status. No other code converts.
#pragma once

#include <grpcpp/support/status.h>

#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "google/rpc/status.pb.h"

namespace liquidblend::client {

// Same code; the message also carries the details that it does not hold already: the reason and
// metadata of ErrorInfo, each field violation of BadRequest, and the delay of RetryInfo. The reason
// is kept (reason.h). But a CANCELLED without details becomes kUnavailable: gRPC ends calls with it
// when a server shuts down.
absl::Status FromGrpc(const grpc::Status& status);
absl::Status FromProto(const google::rpc::Status& status);

// The delay before a new attempt (RetryInfo) of kResourceExhausted and kUnavailable.
std::optional<absl::Duration> RetryDelay(const absl::Status& status);

}  // namespace liquidblend::client

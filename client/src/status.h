// The one place where grpc::Status and google.rpc.Status become absl::Status.
#pragma once

#include <grpcpp/support/status.h>

#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "google/rpc/status.pb.h"

namespace liquidblend::client {

// Same code; the message also carries the details that it does not hold already: the reason and
// metadata of ErrorInfo, each field violation of BadRequest, and the delay of RetryInfo. But a bare
// CANCELLED is kUnavailable: whoever has cancelled a call knows that without asking.
absl::Status FromGrpc(const grpc::Status& status);
absl::Status FromProto(const google::rpc::Status& status);

// When a status of these two says to try again (RetryInfo): of kResourceExhausted and kUnavailable.
std::optional<absl::Duration> RetryDelay(const absl::Status& status);

}  // namespace liquidblend::client

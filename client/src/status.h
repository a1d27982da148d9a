// The one place where grpc::Status and google.rpc.Status become absl::Status.
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"
#include "google/rpc/status.pb.h"

namespace liquidblend::client {

// Same code; the message also carries the details: the reason and metadata of ErrorInfo, and each
// field violation of BadRequest.
absl::Status FromGrpc(const grpc::Status& status);
absl::Status FromProto(const google::rpc::Status& status);

}  // namespace liquidblend::client

// Statuses for clients: code, message and google.rpc details of an error, on any wire.
#pragma once

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "google/rpc/status.pb.h"

namespace liquidblend::server {

// Code and message as they are, the message as clean text of at most 1,000 bytes. Details: the
// field violations if there are any; always a google.rpc.ErrorInfo (domain "liquidblend"; reason:
// WithReason()'s, or the code's name); and a google.rpc.RetryInfo if it is kUnavailable, or has one
// already.
// Requires: !status.ok().
google::rpc::Status ToStatusDetails(const absl::Status& status);

// The delay of the status' google.rpc.RetryInfo; zero if it has none.
absl::Duration RetryDelay(const absl::Status& status);

}  // namespace liquidblend::server

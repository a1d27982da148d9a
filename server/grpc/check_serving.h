// Health check of a server of this machine, as probes make it.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "server/grpc/tls.h"

namespace liquidblend::server {

// OK if the server that was started with these options reports SERVING by grpc.health.v1.
//   listen  as the server was given it: HOST:PORT; of every address of the machine, the loopback
//   tls     as well; its certificate is not verified, and shown as the caller's own if client_ca
//           asks for one
// Errors: kUnavailable (no answer, or not serving), kInvalidArgument (port 0), kNotFound (a file).
absl::Status CheckServing(const std::string& listen, const TlsOptions& tls, absl::Duration timeout);

}  // namespace liquidblend::server

// What the log tells of answers and WebSockets.
#pragma once

#include <string>

#include "absl/time/time.h"
#include "server/http/messages.h"
#include "server/rpc/call_log.h"

namespace liquidblend::http {

// With method, path and status.
rpc::EndedCall EndedRequest(const Request& request, const std::string& path,
                            const rpc::Caller& caller, const Response& response,
                            absl::Duration took);

// Likewise; the status is the code with which the WebSocket was closed.
rpc::EndedCall EndedStream(const std::string& path, const rpc::Caller& caller, int close_code,
                           const std::string& reason, absl::Duration took);

}  // namespace liquidblend::http

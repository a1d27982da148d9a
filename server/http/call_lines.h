// Log lines of answers and WebSockets.
#pragma once

#include <string>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/access/call_log.h"
#include "server/http/exchange/exchange.h"

namespace liquidblend::http {

// The log entry of an answer, with method, path, status and the resource that it is about.
server::EndedCall EndedRequest(const Exchange& exchange, const std::string& path,
                               const Response& response, absl::Duration took);

// Likewise; the status is the code with which the WebSocket was closed: the server's, or that of
// ClientCloseCode().
server::EndedCall EndedStream(const std::string& path, const server::Caller& caller, int close_code,
                              absl::string_view reason, absl::Duration took);

}  // namespace liquidblend::http

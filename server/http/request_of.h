// A request's header as a plain value. Only for port.cc.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/trace/context.h"
#include "server/base/request_id.h"
#include "server/http/core.h"
#include "server/http/exchange/messages.h"

namespace liquidblend::http {

inline constexpr uint64_t kMostBytes = std::numeric_limits<int64_t>::max();

inline std::string TextOf(beast::string_view text) { return {text.data(), text.size()}; }

// The values of all headers of that name, joined. So several hosts are refused as an invalid name.
inline std::string ValuesOf(const HttpRequest& message, const char* name) {
  const auto [begin, end] = message.equal_range(name);
  std::string values;
  for (auto field = begin; field != end; ++field) {
    absl::StrAppend(&values, values.empty() ? "" : ", ", TextOf(field->value()));
  }
  return values;
}

// Requires: the parser has read the header.
inline Request RequestOf(const bhttp::request_parser<bhttp::empty_body>& parser,
                         const std::string& peer) {
  const HttpRequest& message = parser.get();
  Request request;
  request.method = TextOf(message.method_string());
  request.target = TextOf(message.target());
  request.host = ValuesOf(message, "Host");
  request.origin = TextOf(message[bhttp::field::origin]);
  request.authorization = TextOf(message[bhttp::field::authorization]);
  request.accept_encoding = TextOf(message[bhttp::field::accept_encoding]);
  request.if_none_match = TextOf(message[bhttp::field::if_none_match]);
  request.request_id = TextOf(message[server::kRequestIdHeader]);
  request.content_type = TextOf(message[bhttp::field::content_type]);
  request.protocols = ValuesOf(message, "Sec-WebSocket-Protocol");
  request.traceparent = ValuesOf(message, trace::kTraceparent);
  request.tracestate = ValuesOf(message, trace::kTracestate);
  request.peer = peer;
  const uint64_t body_bytes = parser.content_length().value_or(0);
  request.body_bytes = static_cast<int64_t>(std::min(body_bytes, kMostBytes));
  request.has_body = parser.chunked() || body_bytes > 0;
  return request;
}

}  // namespace liquidblend::http

// Requests and answers of the HTTP port as plain values.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/trace/span.h"
#include "server/http/exchange/line_source.h"

namespace liquidblend::http {

struct Request {
  std::string method;           // "GET", "HEAD", "OPTIONS" or what else was sent
  std::string target;           // path and query as sent
  std::string host;             // these headers, or empty
  std::string origin;           //
  std::string authorization;    //
  std::string if_none_match;    //
  std::string accept_encoding;  //
  std::string request_id;       //
  std::string content_type;     //
  std::string protocols;        // Sec-WebSocket-Protocol, all of them
  std::string traceparent;      // all of them
  std::string tracestate;       // likewise
  std::string peer;             // address of the client, e.g. "127.0.0.1:51234"
  bool has_body = false;
  int64_t body_bytes = 0;  // as announced; 0: it is not known, or there is no body
};

struct Response {
  int code = 200;
  std::vector<std::pair<std::string, std::string>> headers;  // without those of the connection
  std::string body;                                          // empty for codes 204 and 304
  std::optional<uint64_t> left_out_bytes;                    // of a body that HEAD does not need
  bool is_frame = false;                                     // for metrics
  std::string error;                                         // for the log; empty: success
  std::shared_ptr<LineSource> lines;  // instead of the body, if there are any
  std::shared_ptr<void> memory;       // of the body, taken from a budget
  trace::Span span;                   // of the call; it ends once this has gone out
};

}  // namespace liquidblend::http

// Subprotocols that a WebSocket's client offers. A page cannot set the header Authorization of a
// WebSocket, so its token comes as one of them.
#pragma once

#include <string>

namespace liquidblend::http {

inline constexpr char kStreamProtocol[] = "liquidblend.v1";

struct Protocols {
  bool has_ours = false;  // kStreamProtocol, which is the answer then
  std::string token;      // of "liquidblend.bearer." and its base64url; empty: none
};

// Of the value of Sec-WebSocket-Protocol. What is not base64url is taken as it is: no token is so.
Protocols ParseProtocols(const std::string& header);

}  // namespace liquidblend::http

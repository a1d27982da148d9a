// Checks what a client of the HTTP port gets.
#pragma once

#include <string_view>

namespace liquidblend::fuzz {

// Whole answers, one after the other; the last one may be cut off. After a 101 come WebSocket
// frames. Ends the process if it is something else.
void CheckHttpOutput(std::string_view output);

// Frames of a WebSocket's server: whole binary messages that are StreamFramesResponse, numbered
// from 0, control frames, and nothing after a close frame. The last one may be cut off.
void CheckWebSocketOutput(std::string_view output);

}  // namespace liquidblend::fuzz

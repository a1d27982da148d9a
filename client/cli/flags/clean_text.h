// Text of others, a server's above all, that goes to a terminal.
#pragma once

#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::cli {

// `text` as valid UTF-8 without what a terminal obeys: '?' in place of each control character (C0,
// DEL, C1) and each that reorders or breaks lines (U+061C, U+200E, U+200F, U+2028 to U+202E, U+2066
// to U+2069), and of each byte that is no UTF-8. CleanText() leaves newlines, CleanLine() has none.
// The server's CleanText (server/base/errors.h) is stricter about length only: what a server sends
// need not have passed it.
// Threads: safe.  Cost: O(n).
std::string CleanText(absl::string_view text);
std::string CleanLine(absl::string_view text);

// JSON with the control characters that may stand in its strings as they are, DEL and C1, escaped.
// Requires: `json` is valid JSON, and UTF-8.
std::string EscapeJson(absl::string_view json);

}  // namespace liquidblend::cli

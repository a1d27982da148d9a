// Hosts in addresses: names and IP addresses.
#pragma once

#include <optional>

#include "absl/strings/string_view.h"

namespace liquidblend::base {

// "HOST:PORT", "HOST", "[IPv6]:PORT" or "[IPv6]", split in two.
struct HostAndPort {
  absl::string_view host;  // without brackets; not empty
  absl::string_view port;  // digits, or empty
  bool is_bracketed = false;
};

// Nothing if the text is none of these. The host may be any text without colons and brackets, or in
// brackets anything.
std::optional<HostAndPort> SplitHostPort(absl::string_view text);

// Whether it is an IP address as text (no names, no brackets, no zone).
bool IsIpAddress(absl::string_view host);

// Whether the host is the loopback interface: 127.0.0.0/8, ::1, the same as IPv4-mapped, and
// exactly "localhost". Other names are not looked up: they are not loopback, whatever they look
// like.
bool IsLoopbackHost(absl::string_view host);

}  // namespace liquidblend::base

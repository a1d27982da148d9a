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

// Splits an address into host and port. Nothing if the text has none of these forms. The host may
// be any text without colons and brackets, or in brackets anything.
std::optional<HostAndPort> SplitHostPort(absl::string_view text);

// Whether the host is an IP address as text (no names, no brackets, no zone).
bool IsIpAddress(absl::string_view host);

// Whether the host is the loopback interface: 127.0.0.0/8, the same mapped to IPv6, ::1, or
// "localhost" in any case of letters. Other names are not looked up and do not count as loopback.
bool IsLoopbackHost(absl::string_view host);

}  // namespace liquidblend::base

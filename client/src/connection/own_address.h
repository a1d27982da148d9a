// Addresses that a url of a server must not lead to, and those of proxies. Internal to client/.
#pragma once

#include <sys/socket.h>

#include "absl/strings/string_view.h"

namespace liquidblend::client {

// Whether an address is one of this machine (loopback, unspecified, or of one of its interfaces),
// or link-local: only the machine's own network reaches those, such as the metadata of cloud
// machines. An address that is neither IPv4 nor IPv6 counts as one.
//   address  as long as its family says
// Threads: safe.
bool IsOwnOrLinkLocal(const sockaddr& address);

// Whether a host is an IPv4 or IPv6 address, as text, of one of this machine's interfaces. Not for
// names: what they mean may change between two looks.
// Threads: safe.
bool IsOwnHost(absl::string_view host);

// Whether the address, with its port, is that of a proxy which the environment names for HTTP
// (http_proxy, https_proxy, HTTPS_PROXY, all_proxy, ALL_PROXY). Their hosts are looked up.
// Threads: safe, as long as none changes the environment.
bool IsProxyOfEnvironment(const sockaddr& address);

}  // namespace liquidblend::client

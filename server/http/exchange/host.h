// Checks of a request's Host and Origin against the names of this server.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"

namespace liquidblend::http {

// OK if `host`, a value of the header Host, is an IP address, localhost, or one of `names`, with or
// without a port; also if it is empty, which browsers never send. "*" among the names takes any.
// Otherwise a page of any site could read this server: its own name may resolve to this machine's
// address as soon as the page is loaded (DNS rebinding), and then the browser takes both for one
// site. The Host still is the page's name.
// Errors: kPermissionDenied, HOST_NOT_ALLOWED, naming the flag --http-host.
absl::Status CheckHost(const std::string& host, const std::vector<std::string>& names);

// OK for a request without `origin` (of no browser, or of a page of this server that only reads),
// of a page of `host`, or of `allowed` ("*": of any). Otherwise a page of any site could have its
// reader's browser change something here: simple requests go out unasked, and only their answers
// are kept from the page.
// Errors: kPermissionDenied, ORIGIN_NOT_ALLOWED, naming the flag --http-origin.
absl::Status CheckOrigin(const std::string& origin, const std::string& host,
                         const std::string& allowed);

// Whether it is a name that CheckHost() can take: of a host without port, or "*".
bool IsHostName(const std::string& name);

}  // namespace liquidblend::http

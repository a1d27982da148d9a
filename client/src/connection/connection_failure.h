// Explanations of failed connections to a server, in a sentence for the user.
#pragma once

#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::client {

// Explains gRPC's own message about its last attempt: the cause and what to do. Empty if the
// message is not known.
//   uses_tls  whether the attempt was made with TLS
std::string ExplainConnectionFailure(absl::string_view words, bool uses_tls);

}  // namespace liquidblend::client

// Reasons why no connection to a server comes about, in a sentence for whoever gave the address.
#pragma once

#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::client {

// The sentence for gRPC's own words about its last attempt: the culprit and what to do. Empty if
// they say nothing that is known.
//   uses_tls  whether the attempt was made with TLS
std::string ExplainConnectionFailure(absl::string_view words, bool uses_tls);

}  // namespace liquidblend::client

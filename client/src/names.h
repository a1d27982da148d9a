// Names of resources and requests.
#pragma once

#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::client {

// "drops" -> "animations/drops"; a name that has the collection already stays as it is.
std::string ResourceName(const std::string& collection, const std::string& id_or_name);

// "animations/drops" -> "drops"; an id stays as it is.
std::string ResourceId(const std::string& collection, const std::string& id_or_name);

// Whether a name may stand in a command that a user copies: 1 to 200 of A-Z, a-z, 0-9, '/', '_',
// '.' and '-', and no '-' at its beginning.
bool IsSafeToPaste(absl::string_view name);

// A random UUID (version 4).
std::string MakeRequestId();

}  // namespace liquidblend::client

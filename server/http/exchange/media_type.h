// Types of bodies.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace liquidblend::http {

// OK if the value of Content-Type is `expected`, with or without parameters.
// Errors: kInvalidArgument.
absl::Status CheckMediaType(const std::string& content_type, const std::string& expected);

}  // namespace liquidblend::http

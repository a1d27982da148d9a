// Request ids, which identify requests in the log and in answers.
#pragma once

#include <cstddef>
#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::server {

inline constexpr char kRequestIdHeader[] = "x-request-id";
// Limit of the request ids in messages, which make repeated requests safe.
inline constexpr size_t kMaxRequestIdLength = 128;

// The value of the client's header, if it is up to 64 of [A-Za-z0-9._:-]; otherwise 16 random
// hexadecimal digits.  Threads: safe.
std::string RequestIdOf(absl::string_view header);

}  // namespace liquidblend::server

// Random identifiers, unique in practice.
#pragma once

#include <string>

namespace liquidblend::base {

// Makes 2 * num_bytes random hexadecimal digits, from the system's generator.  Threads: safe.
std::string RandomHex(int num_bytes);

}  // namespace liquidblend::base

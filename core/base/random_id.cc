#include "core/base/random_id.h"

#include <sys/random.h>

#include "absl/strings/escaping.h"

namespace liquidblend::base {

std::string RandomHex(int num_bytes) {
  std::string bytes(static_cast<size_t>(num_bytes), '\0');
  // getrandom() returns up to 256 bytes at once. A call that is interrupted returns none.
  while (getrandom(bytes.data(), bytes.size(), 0) != num_bytes) {
  }
  return absl::BytesToHexString(bytes);
}

}  // namespace liquidblend::base

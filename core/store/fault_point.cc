#include "core/store/fault_point.h"

#include <csignal>
#include <cstdlib>

namespace liquidblend::store {

void FaultPoint(absl::string_view name) {
  const char* const chosen = std::getenv("LIQUIDBLEND_FAULT_POINT");
  if (chosen != nullptr && name == chosen) std::raise(SIGKILL);
}

}  // namespace liquidblend::store

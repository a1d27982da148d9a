#include "core/base/fault_point.h"

#include <atomic>
#include <csignal>
#include <cstdlib>

#include "absl/strings/numbers.h"

namespace liquidblend::base {
namespace {

// Whether the process dies at the fault point `name` now, if LIQUIDBLEND_FAULT_POINT is `chosen`.
bool IsHere(absl::string_view chosen, absl::string_view name) {
  const size_t mark = chosen.find('#');
  if (name != chosen.substr(0, mark)) return false;
  int number = 0;
  if (mark == absl::string_view::npos || !absl::SimpleAtoi(chosen.substr(mark + 1), &number)) {
    return true;
  }
  static std::atomic<int> num_passes = 0;
  return ++num_passes == number;
}

}  // namespace

void FaultPoint(absl::string_view name) {
  const char* const chosen = std::getenv("LIQUIDBLEND_FAULT_POINT");
  if (chosen != nullptr && IsHere(chosen, name)) std::raise(SIGKILL);
}

}  // namespace liquidblend::base

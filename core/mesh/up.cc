#include "core/mesh/up.h"

#include <array>

namespace liquidblend::mesh {
namespace {

constexpr std::array<const char*, 7> kNames = {"unknown", "x", "y", "z", "-x", "-y", "-z"};

}  // namespace

HeightAxis AxisOf(Up up) {
  if (up == Up::kUnknown) return AxisOf(Up::kZ);
  const int number = static_cast<int>(up) - 1;
  return {number % 3, number < 3 ? 1 : -1};
}

std::string NameOf(Up up) { return kNames[static_cast<size_t>(up)]; }

std::optional<Up> UpOfName(absl::string_view name) {
  for (size_t n = 1; n < kNames.size(); ++n) {
    if (name == kNames[n]) return static_cast<Up>(n);
  }
  return std::nullopt;
}

std::string DescribeUp(Up up) { return up == Up::kUnknown ? "z (assumed)" : NameOf(up); }

}  // namespace liquidblend::mesh

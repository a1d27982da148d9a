#include "liquidblend/up.h"

#include <array>
#include <cstddef>

namespace liquidblend {
namespace {

constexpr std::array<const char*, 7> kNames = {"unknown", "x", "y", "z", "-x", "-y", "-z"};

}  // namespace

std::string NameOf(Up up) { return kNames[static_cast<size_t>(up)]; }

std::optional<Up> UpOfName(const std::string& name) {
  for (size_t n = 1; n < kNames.size(); ++n) {
    if (name == kNames[n]) return static_cast<Up>(n);
  }
  return std::nullopt;
}

}  // namespace liquidblend

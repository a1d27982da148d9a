// The upward direction of an animation.
#pragma once

#include <optional>
#include <string>

namespace liquidblend {

// kUnknown: z is assumed.
enum class Up { kUnknown, kX, kY, kZ, kMinusX, kMinusY, kMinusZ };

// "x", "-y" and so on; "unknown".
std::string NameOf(Up up);

// The inverse of NameOf(), without "unknown"; nothing: not one of the six.
std::optional<Up> UpOfName(const std::string& name);

}  // namespace liquidblend

// The upward direction of an animation.
#pragma once

#include <optional>
#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::mesh {

// The numbers are those of the API and of the files.
enum class Up { kUnknown = 0, kX, kY, kZ, kMinusX, kMinusY, kMinusZ };

// A coordinate and the sign that makes it a height.
struct HeightAxis {
  int axis = 2;  // 0 to 2: x, y, z
  int sign = 1;  // 1 or -1
  bool operator==(const HeightAxis&) const = default;
};

// The axis of `up`; z if it is kUnknown.
HeightAxis AxisOf(Up up);

// "x", "-y" and so on; "unknown".
std::string NameOf(Up up);

// The inverse of NameOf(), without "unknown"; nothing: not one of the six.
std::optional<Up> UpOfName(absl::string_view name);

// "y", or "z (assumed)" if it is unknown.
std::string DescribeUp(Up up);

}  // namespace liquidblend::mesh

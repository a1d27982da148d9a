// The upward direction of an animation.
#pragma once

#include <optional>
#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::mesh {

// Upward direction of an animation. The numbers are those of the API and of the files.
enum class Up { kUnknown = 0, kX, kY, kZ, kMinusX, kMinusY, kMinusZ };

// Height of a point: a coordinate, and the sign that makes it a height.
struct HeightAxis {
  int axis = 2;  // 0 to 2: x, y, z
  int sign = 1;  // 1 or -1
  bool operator==(const HeightAxis&) const = default;
};

// The axis of `up`; z if it is kUnknown.
HeightAxis AxisOf(Up up);

// The name of the direction: "x", "-y" and so on, or "unknown".
std::string NameOf(Up up);

// The direction of a name such as "x" or "-y", as NameOf() writes them. Nothing if the name is not
// one of the six.
std::optional<Up> UpOfName(absl::string_view name);

// The direction as reports show it: "y", or "z (assumed)" if it is unknown.
std::string DescribeUp(Up up);

}  // namespace liquidblend::mesh

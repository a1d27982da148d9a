// Encoding grid: the grid to which positions are rounded on the wire. A family has one for all
// frames, so that nothing jitters from frame to frame.
#pragma once

#include <array>
#include <optional>

#include "core/mesh/registered_family.h"

namespace liquidblend::frames {

// Range of the bits of a coordinate.
inline constexpr int kMinPositionBits = 8;
inline constexpr int kMaxPositionBits = 20;

// A cube, cut into 2^position_bits - 1 steps along each axis; metres.
struct Grid {
  std::array<float, 3> origin = {0, 0, 0};  // lowest corner
  float extent_m = 1.0F;                    // > 0; length of its edges
};

// The grid's step in metres. Requires: bits in [kMinPositionBits, kMaxPositionBits].
double StepOf(const Grid& grid, int bits);

// The fewest bits whose step is at most step_m; nothing if kMaxPositionBits do not suffice.
std::optional<int> BitsForStep(const Grid& grid, double step_m);

// The smallest cube, from the lowest corner, around the family's domain and its source's vertices,
// so around every blend of it. Requires: family passed Validate().  Cost: O(vertices).
Grid GridOf(const mesh::RegisteredFamily& family);

}  // namespace liquidblend::frames

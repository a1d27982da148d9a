#include "core/frames/grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace liquidblend::frames {

double StepOf(const Grid& grid, int bits) { return grid.extent_m / (std::exp2(bits) - 1.0); }

std::optional<int> BitsForStep(const Grid& grid, double step_m) {
  for (int bits = kMinPositionBits; bits <= kMaxPositionBits; ++bits) {
    if (StepOf(grid, bits) <= step_m) return bits;
  }
  return std::nullopt;
}

Grid GridOf(const mesh::RegisteredFamily& family) {
  std::array<float, 3> low = family.domain_min;
  std::array<float, 3> high = family.domain_max;
  for (const mesh::Float4& vertex : family.vertices) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], vertex[k]);
      high[k] = std::max(high[k], vertex[k]);
    }
  }
  Grid grid;
  grid.origin = low;
  grid.extent_m = std::numeric_limits<float>::min();
  for (int k = 0; k < 3; ++k) {
    // The extent is rounded up, so that the highest corner is inside whichever way the subtraction
    // rounded.
    const float extent = std::nextafter(high[k] - low[k], std::numeric_limits<float>::infinity());
    grid.extent_m = std::max(grid.extent_m, extent);
  }
  return grid;
}

}  // namespace liquidblend::frames

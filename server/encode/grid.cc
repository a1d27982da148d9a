#include "server/encode/grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace liquidblend::encode {

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
    // Rounded up, so that the highest corner is inside whichever way the subtraction rounded.
    const float extent = std::nextafter(high[k] - low[k], std::numeric_limits<float>::infinity());
    grid.extent_m = std::max(grid.extent_m, extent);
  }
  return grid;
}

}  // namespace liquidblend::encode

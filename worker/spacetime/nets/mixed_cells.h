// Mixed cells of a grid: those with both inside and outside corners. Internal to worker/spacetime.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "worker/spacetime/field/grid.h"

namespace liquidblend::spacetime {

// The mixed cells of some layers, row by row.
class MixedCells {
 public:
  MixedCells(const Grid& grid, std::span<const InsideBits* const> layers);

  // The mixed cells of row (j, k), a bit each. Requires: j + 1 < dims[1], k + 1 < dims[2].
  const std::vector<uint64_t>& Row(int j, int k);

 private:
  std::span<const InsideBits* const> layers_;
  std::vector<uint64_t> any_, all_;  // of the row's corners; one word more than the row has
  std::vector<uint64_t> mixed_;
};

// The corners of all mixed cells.
PointBits CornersOfMixedCells(const Grid& grid, std::span<const InsideBits* const> layers);

}  // namespace liquidblend::spacetime

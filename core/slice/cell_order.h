// Order of cells that keeps neighbours in space-time close together.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/registered_family.h"

namespace liquidblend::slice {

// Place on the Hilbert curve through a grid of 2^10 points a side: successive places are next to
// each other in the grid. Requires: coordinates in [0, 1024).
uint32_t HilbertPlace(std::array<uint32_t, 3> point);

// Cell with its key in the order.
struct OrderedCell {
  uint64_t key = 0;  // slab of time, then the place in space
  int32_t cell = 0;
  // Cells of one slab begin in the same two frame intervals.
  uint64_t slab() const { return key >> 30; }
};

// Orders cells by the slab of time in which they begin, then along a Hilbert curve through space;
// the source's cells, at weight 0. Requires: corners are vertices of the family, which passed
// Validate().  Cost: O(cells log cells).
template <typename Cell>
std::vector<OrderedCell> OrderCells(const mesh::RegisteredFamily& family,
                                    std::span<const Cell> cells);

}  // namespace liquidblend::slice

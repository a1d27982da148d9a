// Order of the two sides of thin sheets: repair of inverted places. Internal to worker/spacetime.
#pragma once

#include <cstdint>

#include "core/parallel/arena.h"
#include "worker/spacetime/nets/layers.h"

namespace liquidblend::spacetime {

// Vertices next to thin sheets may lie outside of their cells (Slab::beyond). Where rays through
// the boxes around grid points (liquid_boxes.h) find liquid inside out, vertices nearby are drawn
// back into their cells, in a few steps, until no place is inverted or all are back. A surface
// whose vertices lie in their cells is hardly ever inside out.
// Returns the number of vertices drawn back. Threads: same bytes for any thread count.
// Cost: O(n log n) in the boxes next to such vertices, and again for boxes along the rays of moved
// vertices.
int64_t KeepSheetOrder(const parallel::Arena& arena, Layers& layers);

}  // namespace liquidblend::spacetime

// Inside test of grid points for a closed surface. Internal to worker/spacetime.
#pragma once

#include "worker/spacetime/field/grid.h"

namespace liquidblend::spacetime {

// Winding number by signed crossings along rows in x: inside is where it is positive, so enclosed
// bubbles stay outside and overlapping parts (of an advected surface) stay inside.
// Requires: a closed, oriented surface that lies within the grid.
// Cost: O(triangles + rows crossed).
InsideBits ComputeInside(const Grid& grid, const GridSurface& surface);

}  // namespace liquidblend::spacetime

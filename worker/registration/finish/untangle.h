// Removal of self-intersections of the deformed surface. Internal to worker/registration.
#pragma once

#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Moves inverted sides apart. Where the surface at weights 0.75, 1 and 1.25 is inside out, two of
// its sides are in the wrong order, mostly by some hundredths of an edge: the sides of a sheet, or
// the sheets of a fold. Rays through the slices at all frames find them, and each side is moved
// along its normal, by at most half an edge, until they overlap a little; then once more there and
// half a frame before and after. Vertices of rigid pieces stay.
//   extrapolation  displacement for weights beyond 1
// Returns the number of inverted spans of rays in the last check.
// Threads: same bytes for any thread count.  Cost: O(cells), and O(n log n) in the size of each
// slice.
int64_t Untangle(const Surface& source, const Points& extrapolation, const parallel::Arena& arena,
                 Points& displacement);

}  // namespace liquidblend::registration

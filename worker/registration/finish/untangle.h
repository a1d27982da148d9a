// Moves apart what has passed through itself. Internal to worker/registration.
#pragma once

#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Where the surface at weights 0.75, 1 and 1.25 is inside out, two of its sides are in the wrong
// order, mostly by some hundredths of an edge: the sides of a sheet, the sheets of a fold. Rays
// through the slices at all frames find them, and each side is moved along its normal, by at most
// half an edge, until they overlap a little; then once more there and half a frame before and
// after. Vertices of rigid pieces stay.
//   extrapolation  that goes with the displacement beyond weight 1
// Returns how many times a ray was inside out when it was last looked at.
// Threads: same bytes for any thread count.  Cost: O(cells), and O(n log n) in the size of each
// slice.
int64_t Untangle(const Surface& source, const Points& extrapolation, const parallel::Arena& arena,
                 Points& displacement);

}  // namespace liquidblend::registration

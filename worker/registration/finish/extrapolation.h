// Extrapolation: displacements for weights outside [0, 1]. Internal to worker/registration.
#pragma once

#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Averages displacements over vertices that are close when deformed, not only along the surface. So
// layers and sides of a thin sheet that are together at weight 1 stay together beyond.
// Threads: same bytes for any thread count.  Cost: O(vertices).
Points Extrapolation(const Surface& source, const PackedLists& neighbors,
                     const Points& displacement, const parallel::Arena& arena);

}  // namespace liquidblend::registration

// Droplets in the displacement field (paper, section 5.3). Internal to worker/registration.
#pragma once

#include "core/parallel/arena.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Moves each rigid piece as a whole, by the motion of the surface around its centroid. Along a
// droplet the moves are smooth and time keeps its order, so that no droplet is distorted, shown
// twice or lost. Droplets take no part in the fit.
// Threads: same bytes for any thread count.  Cost: a nearest-vertex search per piece.
void CarryRigidPieces(const Surface& surface, const parallel::Arena& arena, Points& displacement);

}  // namespace liquidblend::registration

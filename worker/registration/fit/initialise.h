// The nodes' maps before the first iteration (paper, section 6: diffusion of the correspondences).
// Internal to worker/registration.
#pragma once

#include <vector>

#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/energy.h"
#include "worker/registration/fit/pins.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Moves the nodes at the pins by what is missing to their goals, and the others by what `passes`
// passes of the heat equation on the node graph make of that; the pins' nodes are fixed, nodes in
// the end slabs in time. What is far from any pin hardly moves. Only b of each map changes.
// Requires: a node sits at each pin's vertex.  Threads: same bytes for any thread count.
void DiffusePins(const DeformationNodes& nodes, const NodeGraph& graph, const Surface& source,
                 const std::vector<Pin>& pins, int passes, const parallel::Arena& arena,
                 std::vector<NodeMap>& maps);

}  // namespace liquidblend::registration

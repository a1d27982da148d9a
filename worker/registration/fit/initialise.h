// The nodes' maps before the first iteration (paper, section 6: diffusion of the correspondences).
// Internal to worker/registration.
#pragma once

#include <vector>

#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/energy.h"
#include "worker/registration/fit/pins.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Moves the nodes at the pins to their goals, and the others by `passes` steps of the heat equation
// on the node graph, with the pins' nodes fixed, and nodes of the end slabs fixed in time. Nodes
// far from any pin hardly move. Only b of each map changes.
// Requires: a node sits at each pin's vertex.  Threads: same bytes for any thread count.
void DiffusePins(const DeformationNodes& nodes, const NodeGraph& graph, const Surface& source,
                 const std::vector<Pin>& pins, int passes, const parallel::Arena& arena,
                 std::vector<NodeMap>& maps);

}  // namespace liquidblend::registration

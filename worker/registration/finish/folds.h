// Repair of folds and inverted layers of the deformed surface. Internal to worker/registration.
#pragma once

#include "worker/registration/surface/closest_point.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Smooths the displacements where the surface at this weight, in (0, 1], is inverted against its
// neighbourhood, until no vertex is or for a few rounds. It is meant for weights below 1, where the
// sides of a jet may pass through each other; at weight 1 it would cut the tips off. Returns the
// number of vertices that are still inverted.
int64_t RelaxFolds(const Surface& source, const PackedLists& neighbors, float weight,
                   const parallel::Arena& arena, Points& displacement);

// Moves layers that face against the target next to them a little beneath it. Where the surface
// lies on the target in several layers, every other one faces against it; the outermost, which is
// seen, must face outwards. Returns the number of vertices that the last round moved.
int64_t OffsetInvertedLayers(const Surface& source, const PackedLists& neighbors,
                             const ClosestPointSearch& target, const parallel::Arena& arena,
                             Points& displacement);

}  // namespace liquidblend::registration

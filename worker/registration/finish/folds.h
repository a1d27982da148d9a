// Where the deformed surface is turned against itself or the target, and what is done about it.
// Internal to worker/registration.
#pragma once

#include "worker/registration/surface/closest_point.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Smooths the displacements where the surface at this weight, in (0, 1], is turned against its
// neighbourhood, until it is nowhere or for a few rounds. For folds on the way, in which the sides
// of a jet pass through each other; at weight 1 it would cut the tips off. Returns the number of
// vertices that are still turned.
int64_t RelaxFolds(const Surface& source, const PackedLists& neighbors, float weight,
                   const parallel::Arena& arena, Points& displacement);

// Moves layers that face against the target next to them a little beneath it. Where the surface
// lies on the target in several layers, every other one faces against it: a liquid of several
// layers shows the outermost, which must face outwards. Returns how many vertices the last of the
// rounds moved.
int64_t TuckTurnedLayers(const Surface& source, const PackedLists& neighbors,
                         const ClosestPointSearch& target, const parallel::Arena& arena,
                         Points& displacement);

}  // namespace liquidblend::registration

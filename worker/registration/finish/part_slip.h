// Slip of detached parts: counterparts of a part's vertices that are turned against one another, or
// early and late ones. Internal to worker/registration.
#pragma once

#include "worker/registration/features/part_motions.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Moves the images of the vertices of detached parts along the target's surface to where they would
// be if each part moved as a whole: shifted, and scaled to the target's size. At weight 1 the
// surface stays the same. Between, a part whose images have slipped by an angle a has lost some 3/8
// a^2 of its volume.
//   displacement  a column per source vertex, registration units
// Times of first and last slabs stay.  Threads: same bytes for any thread count.
void RemovePartSlip(const Surface& source, const PackedLists& neighbors, const PartMotions& motions,
                    const parallel::Arena& arena, Points& displacement);

}  // namespace liquidblend::registration

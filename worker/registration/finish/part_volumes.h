// Volumes of parts that both animations have (part_motions.h). Internal to worker/registration.
#pragma once

#include "worker/registration/features/part_motions.h"

namespace liquidblend::registration {

// Moves the vertices of part motions along their normals in space: at weight 1 each part gets the
// target's volume in each of the target's frames. Otherwise, where a part falls by several edges a
// frame, a residual of some hundredths of an edge in space-time would be a tenth of one in space.
// A part that would have to move by more than a fifth of an edge is left unchanged.
// Threads: same bytes for any thread count.  Cost: slices at the target's frames, three times.
void MatchPartVolumes(const Surface& source, const PackedLists& neighbors, const Surface& target,
                      const PartMotions& motions, const parallel::Arena& arena,
                      Points& displacement);

}  // namespace liquidblend::registration

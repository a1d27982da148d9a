// Detection of thin sheets of a space-time mesh (paper, section 5.3). Internal to worker/spacetime.
#pragma once

#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"

namespace liquidblend::spacetime {

// Fills mesh.thin: vertices of which more than a tenth of those nearer than `thickness_m`, within
// the same frame of time, lie on the other side of the liquid and face the other way; and two rings
// of their neighbours.
// Requires: mesh.normals, thickness_m > 0.  Threads: same bytes for any thread count.
// Cost: O(vertices) neighbours.
void FlagThinSheets(double thickness_m, const parallel::Arena& arena, mesh::SpaceTimeMesh& mesh);

}  // namespace liquidblend::spacetime

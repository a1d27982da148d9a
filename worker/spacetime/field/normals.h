// Normals of a space-time mesh from its own cells.
#pragma once

#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"

namespace liquidblend::spacetime {

// Fills mesh.normals: at each vertex the mean of the normals of the cells around it, weighted by
// their volume, in the metric where a frame of time is as long as edge_length_m.
// Requires: indices in range, edge_length_m > 0.  Threads: same bytes for any thread count.
void ComputeNormals(mesh::SpaceTimeMesh& mesh, const parallel::Arena& arena);

}  // namespace liquidblend::spacetime

// Removal of specks. Where the time of a single vertex is earlier, or later, than that of all its
// neighbours, a slice shows a piece of liquid, or a hole, for less than a step. Internal to
// worker/spacetime.
#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "worker/spacetime/nets/layers.h"

namespace liquidblend::spacetime {

// Moves such vertices to the mean time of their neighbours, within their slab, in three passes.
//   first_vertex  per slab, of which the net's vertices are the first; those of the end slabs stay
// Requires: mesh.vertices and mesh.hexahedra.  Cost: O(cells).
void FlattenTimeExtrema(const Layers& layers, const std::vector<int64_t>& first_vertex,
                        mesh::SpaceTimeMesh& mesh);

}  // namespace liquidblend::spacetime

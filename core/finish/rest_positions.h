// Rest positions of a slice's vertices: their places in the source.
#pragma once

#include "core/finish/crossed_edges.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::finish {

// Sets surface.rest: the place in the source (x, y, z in metres, time in seconds since the first
// frame) that the blend has moved to the vertex. It is the same for a place of the liquid at any
// weights, so what is textured by it stays on the liquid while weights change. At weights 0 it is
// the vertex' own place and time.
// Requires: surface as sliced; family passed Validate().  Threads: safe, same bytes always.
// Cost: O(vertices).
void AddRestPositions(const mesh::RegisteredFamily& family, const CrossedEdges& crossed,
                      mesh::TriangleMesh& surface);

}  // namespace liquidblend::finish

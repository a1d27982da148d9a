// Velocities of a slice's vertices.
#pragma once

#include "core/finish/crossed_edges.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::finish {

// Sets surface.velocities, m/s. If the family has the velocities of its source, the blend carries
// them along. A particle that goes through space-time in the direction (u, 1) goes in the direction
// J (u, 1) afterwards, J being the derivative of the blend, fitted to the vertices and crossed
// edges around. So times that run twice as fast double the velocities, and at weights 0 they are
// the source's own. No velocity changes by more than its length and a tenth of an edge a frame.
// Otherwise the velocities are the surface's own, along its normals, from the slope of the crossed
// edges in space-time. Requires: surface as sliced, not moved since; family passed Validate().
// Threads: safe, same bytes always.  Cost: O(triangles); with the family's velocities, about 0.1 us
// per triangle.
void AddVelocities(const mesh::RegisteredFamily& family, const CrossedEdges& crossed,
                   mesh::TriangleMesh& surface);

}  // namespace liquidblend::finish

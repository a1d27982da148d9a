// Normals of a surface's vertices.
#pragma once

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::finish {

// Sets surface.normals: the triangles' normals around each vertex, weighted by their areas, so that
// slivers do not count. A vertex whose triangles cancel out or have no area gets (0, 0, 1).
// Requires: surface passed Validate().  Threads: safe, same bytes always.  Cost: O(triangles).
void AddNormals(mesh::TriangleMesh& surface);

}  // namespace liquidblend::finish

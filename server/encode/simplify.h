// Simpler surfaces of fewer triangles, by meshoptimizer.
#pragma once

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::encode {

// The surface with about `share` of its triangles: edges are collapsed, those first that change it
// least. What is closed and oriented stays so. Velocities stay with their vertices; vertices that
// no triangle uses are left out, and normals are not kept. Requires: surface passed Validate();
// share in (0, 1].  Threads: safe, same bytes always. Cost: 0.3 us per triangle.
mesh::TriangleMesh Simplify(const mesh::TriangleMesh& surface, double share);

}  // namespace liquidblend::encode

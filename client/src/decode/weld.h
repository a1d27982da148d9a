// Joins parts of a mesh that a Draco encoder had to take apart. Internal to client/src.
#pragma once

#include "liquidblend/mesh.h"

namespace liquidblend {

// Edgebreaker codes manifolds only, so at non-manifold edges the decoded parts have open edges with
// vertices of their own at the same places. Joins such vertices, but only along open edges:
// elsewhere distinct vertices may have been rounded to one place. Triangles that lose their area by
// this are dropped, and unused vertices.
// Cost: O(triangles log triangles); a mesh without open edges stays as it is.
void WeldOpenEdges(Mesh& mesh);

}  // namespace liquidblend

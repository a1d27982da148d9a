// Joins what a Draco encoder had to take apart. Internal to client/src.
#pragma once

#include "liquidblend/mesh.h"

namespace liquidblend {

// Edgebreaker codes manifolds only, so where four triangles meet at an edge the decoded parts have
// open edges with vertices of their own at the same places. Joins such vertices, but only along
// open edges: elsewhere distinct vertices may have been rounded to one place. Triangles that lose
// their area so are dropped, and vertices that nothing refers to any more.
// Cost: O(triangles log triangles); a mesh without open edges stays as it is.
void WeldOpenEdges(Mesh& mesh);

}  // namespace liquidblend

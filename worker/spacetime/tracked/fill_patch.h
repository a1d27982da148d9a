// Fills a closed surface between two frames with cells. Internal to worker/spacetime.
#pragma once

#include <vector>

#include "worker/spacetime/tracked/track_cells.h"

namespace liquidblend::spacetime {

struct FillOptions {
  double cone_radius_m = 0.3;  // >= 0; larger patches are filled with anchors
  double anchor_m = 0.2;       // > 0; spacing of the anchors
};

// Adds cells whose boundary is the patch, and vertices half-way between the frames. - A small patch
// becomes a cone from its centroid: tetrahedra over triangles, pyramids over quads. - A large one
// (a part of the liquid that was rebuilt) would shrink to one point on the way. Its
//   vertices gather at the vertices of a coarse surface instead, the anchors: each triangle moves
//   to the triangle of its anchors, in tetrahedra by the vertex-label rule of the paper's appendix.
//   Where both frames lie close together, their coarse triangles cancel; cones fill what is left.
// Requires: the patch is closed and oriented (each directed edge has its opposite).
void FillPatch(const FramePair& pair, const std::vector<Facet>& patch, const FillOptions& options,
               PairCells& cells);

}  // namespace liquidblend::spacetime

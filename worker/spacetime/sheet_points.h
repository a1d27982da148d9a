// Keeps sheets that are thinner than the grid's spacing in one piece. Internal to worker/spacetime.
#pragma once

#include <tuple>
#include <vector>

#include "worker/spacetime/grid.h"

namespace liquidblend::spacetime {

struct SheetPoint {
  int i, j, k;
  float thickness;  // of the sheet next to it, grid units
};

// The order of points: by k, then j, then i.
inline bool Precedes(const SheetPoint& a, const SheetPoint& b) {
  return std::tie(a.k, a.j, a.i) < std::tie(b.k, b.j, b.i);
}

// The grid points that are to be inside so that thin sheets have no holes: as many as a sheet needs
// for them to hang together through faces of the grid and to leave no way through it, not even
// across the diagonal of a face. With n the sheet's unit normal these are the points nearer to its
// middle than half of the sum of the two largest of |n_x|, |n_y|, |n_z|: a single layer of points
// for one that lies along the grid. A sheet that is thicker than that has none. Nothing is added
// beyond its rim: the grid line through a point that is nearest to the normal meets the sheet.
// Ascending; each point once.
// Cost: O(n log n) in the triangles.
std::vector<SheetPoint> FindSheetPoints(const Grid& grid, const GridSurface& surface);

}  // namespace liquidblend::spacetime

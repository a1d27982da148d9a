// Sheet points: grid points that keep sheets thinner than the grid's spacing in one piece. Internal
// to worker/spacetime.
#pragma once

#include <tuple>
#include <vector>

#include "absl/functional/function_ref.h"
#include "worker/spacetime/field/grid.h"

namespace liquidblend::spacetime {

struct SheetPoint {
  int i, j, k;
  float thickness;  // of the sheet next to it, grid units
};

// The order of points: by k, then j, then i.
inline bool Precedes(const SheetPoint& a, const SheetPoint& b) {
  return std::tie(a.k, a.j, a.i) < std::tie(b.k, b.j, b.i);
}

// The grid points that have to be inside so that thin sheets stay whole. They are connected through
// faces of the grid, and leave no path through the sheet, not even across the diagonal of a face,
// in space and from layer to layer.
// Let n be the sheet's unit normal, and n_t its motion along n until the next layer. A point counts
// if it is nearer to the sheet's middle than half of the sum of the two largest of |n_x|, |n_y|,
// |n_z| and |n_t|, plus a small margin: for a still sheet along the grid, a single layer of points.
// Thicker sheets have none. No point lies beyond the sheet's rim: the grid line through it that is
// nearest to the normal meets the sheet. Ascending; each point once; none at the ends of the grid.
//   motion  spacings that one metre per second covers from layer to layer
// Cost: O(n log n) in the triangles.
std::vector<SheetPoint> FindSheetPoints(const Grid& grid, const GridSurface& surface, float motion);

// Makes the points inside, and where one of them touches an inside point across the diagonal of a
// face only, the nearer of the two points between them as well, which is added to the points.
//   distance  of point (i, j, k) to the surface
void AddToInside(const Grid& grid, absl::FunctionRef<float(int, int, int)> distance,
                 std::vector<SheetPoint>& points, InsideBits& inside);

}  // namespace liquidblend::spacetime

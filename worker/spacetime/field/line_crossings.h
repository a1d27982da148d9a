// Crossings of a grid's lines along one axis with a surface. Internal to worker/spacetime.
#pragma once

#include <cstdint>
#include <vector>

#include "worker/spacetime/field/grid.h"

namespace liquidblend::spacetime {

// The lines along an axis, one through each grid point of the other two axes u and v, which follow
// it cyclically. Along x they are the grid's rows.
struct GridLines {
  int axis, u, v;  // 0 1 2, 1 2 0 or 2 0 1
  int num_u, num_v;
  GridLines(const Grid& grid, int along)
      : axis(along),
        u((along + 1) % 3),
        v((along + 2) % 3),
        num_u(grid.dims[u]),
        num_v(grid.dims[v]) {}
  int64_t Line(int at_u, int at_v) const { return static_cast<int64_t>(at_v) * num_u + at_u; }
};

struct Crossing {
  int64_t line;
  double at;    // along the line, grid units
  int winding;  // added to the winding number beyond it: 1 where liquid begins, else -1
  int32_t triangle;
};

// Lines are shifted a little off the grid so that they meet no vertex or edge of a mesh whose
// coordinates are special; another shift is to be tried where rounding still made the crossings
// disagree.
struct LineShift {
  double u, v;
};
inline constexpr int kNumLineShifts = 8;
LineShift NthLineShift(int n);

// Appends the crossing of one line with triangle t, if there is one.
void CrossLine(const GridSurface& surface, int64_t t, const GridLines& lines, int64_t line,
               LineShift shift, std::vector<Crossing>& crossings);

// Appends the crossings of all lines with triangle t.
void CrossLines(const GridSurface& surface, int64_t t, const GridLines& lines, LineShift shift,
                std::vector<Crossing>& crossings);

}  // namespace liquidblend::spacetime

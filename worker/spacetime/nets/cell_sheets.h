// The separate sheets of the surface within one 4D cell. Internal to worker/spacetime.
#pragma once

#include <array>
#include <cstdint>

namespace liquidblend::spacetime {

// Corners of a cell are numbered by their bits x, y, z, t; an edge by its axis and its lower end.
inline constexpr int kNumCellEdges = 32;
inline int CellEdge(int axis, int lower_corner) {
  const int below = lower_corner & ((1 << axis) - 1), above = lower_corner >> (axis + 1);
  return axis * 8 + (below | above << axis);
}
inline int AxisOf(int edge) { return edge / 8; }
inline int LowerEnd(int edge) {
  const int axis = AxisOf(edge), rest = edge % 8;
  return (rest & ((1 << axis) - 1)) | rest >> axis << (axis + 1);
}

// The edges with one end inside and one outside, a bit each.
//   inside  bit c: corner c is inside
uint32_t CrossedEdges(uint16_t inside);

struct CellSheets {
  int count = 0;                               // 0: the corners are all inside or all outside
  std::array<uint32_t, 8> edges = {};          // per sheet: the crossed edges, a bit each
  std::array<int8_t, kNumCellEdges> sheet_of;  // per edge; -1: not crossed
};

// Crossed edges belong to the same sheet if a face of the cell connects them. Where all four edges
// of a face are crossed, those around each of its two inside corners are: the liquid's parts are
// kept apart, alike in all cells that share the face. So each facet of the dual complex belongs to
// two cells of it, but for rare faces whose two sheets meet again in all four cells around.
//   inside  bit c: corner c is inside
// Most cells have one sheet (NumSheets), to which all crossed edges belong.
CellSheets FindSheets(uint16_t inside);

// FindSheets(inside).count, from a table.
int NumSheets(uint16_t inside);

}  // namespace liquidblend::spacetime

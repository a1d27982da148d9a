// Cut cell: a 4D cell beside cells that are cut more finely in time, whose edges and faces are cut
// at the layers of these cells, too. Internal to worker/spacetime.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/spacetime/field/grid.h"
#include "worker/spacetime/nets/slab_steps.h"

namespace liquidblend::spacetime {

// Corners are numbered by their bits x, y, z; spatial edges by axis * 4 and the bits of the other
// two axes; layers from the cell's first one.
struct CutCell {
  static constexpr int kNumSpatialEdges = 12;
  int span = 1;                                              // the last layer
  std::array<LayerMask, 8> corner_layers = {};               // where the corner's time edge is cut
  std::array<LayerMask, 8> corner_inside = {};               // of those layers
  std::array<LayerMask, kNumSpatialEdges> edge_layers = {};  // where there is such an edge
  std::array<LayerMask, 6> face_layers = {};                 // per spatial face: axis * 2 + upper
};

// An edge of a cut cell: along `axis` (3: time) from `corner` at `layer`, to the next layer at
// which the corner's time edge is cut.
struct CutCellEdge {
  int8_t axis;
  int8_t corner;  // the lower one
  int8_t layer;
};

// The first layer of the mask after `layer`.
inline int NextLayer(LayerMask layers, int layer) {
  return std::countr_zero(static_cast<unsigned>(layers) >> (layer + 1)) + layer + 1;
}

inline constexpr int kNumCutCellEdges = 8 * 8 + CutCell::kNumSpatialEdges * 9;
int IndexOf(const CutCellEdge& edge);

// The separate sheets of the surface, as CellSheets has them for a cell that is not cut.
struct CutCellSheets {
  int count = 0;
  std::array<int8_t, kNumCutCellEdges> sheet_of;  // per edge; -1: not crossed, or no edge
  std::vector<CutCellEdge> crossed;               // all of them
};

//   layers  of the slab
//   begin   the cell's first layer in the slab
CutCell GatherCutCell(const SlabSteps& steps, std::span<const InsideBits* const> layers, int i,
                      int j, int k, int begin);

// Crossed edges that follow one another around inside corners of one of the cell's faces belong to
// the same sheet. Each such face is a face of all the cells around it, whatever they span, and
// these join the same edges: so the dual complex is closed.
CutCellSheets FindSheets(const CutCell& cell);

}  // namespace liquidblend::spacetime

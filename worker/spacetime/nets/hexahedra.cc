#include <algorithm>
#include <cassert>
#include <utility>

#include "worker/spacetime/nets/cell_sheets.h"
#include "worker/spacetime/nets/cut_cell.h"
#include "worker/spacetime/nets/surface_nets.h"

namespace liquidblend::spacetime {
namespace {

using Point = std::array<int, 3>;

// Finds the cells of a slab. Quick if those of neighbouring rows are asked for along x.
class CellFinder {
 public:
  CellFinder(const Grid& grid, const Slab& slab) : grid_(grid), slab_(slab) {}

  // As FindCell. Requires: there is one.
  const Slab::Cell& Find(int step, const Point& voxel) {
    const int64_t row = grid_.Row(voxel[1], voxel[2]);
    Cursor& cursor = cursors_[(voxel[1] & 1) | (voxel[2] & 1) << 1];
    const Slab::Cell* begin = slab_.cells.data() + slab_.row_begin[row];
    if (cursor.row != row || (cursor.at > begin && cursor.at[-1].i >= voxel[0])) {
      cursor = {row, begin};
    }
    while (cursor.at->i < voxel[0] - 1) ++cursor.at;  // the one before may be asked for next
    const Slab::Cell* found = cursor.at;
    while (found->i < voxel[0] || found->end_layer <= step) ++found;
    assert(found == FindCell(grid_, slab_, step, voxel[0], voxel[1], voxel[2]));
    return *found;
  }

 private:
  struct Cursor {
    int64_t row = -1;
    const Slab::Cell* at = nullptr;
  };
  const Grid& grid_;
  const Slab& slab_;
  std::array<Cursor, 4> cursors_;  // of rows that are even or odd in y and z
};

// One step of a slab; the cells that contain it lie before or after a layer.
struct StepRef {
  const SlabRef* slab;
  int step;
  CellFinder* finder;
};

// The grid edge along `axis` from `point` up, as the cells of one slab see it.
struct GridEdge {
  int axis;
  Point point;
  int layer;  // of the slab; of a temporal edge: where it begins
};

// The vertex of the voxel's cell at a step whose sheet crosses the edge; `corner` of the cell is
// the edge's lower end in space. Requires: the edge is crossed.
int32_t VertexOf(const StepRef& at, const Point& voxel, const GridEdge& edge, int corner) {
  const Slab::Cell& cell = at.finder->Find(at.step, voxel);
  const int64_t first = at.slab->first_vertex + cell.first_vertex;
  if (cell.num_sheets == 1) return static_cast<int32_t>(first);
  if (cell.is_cut) {
    const CutCellSheets sheets = FindSheets(GatherCutCell(
        at.slab->slab->steps, at.slab->layers, voxel[0], voxel[1], voxel[2], cell.begin_layer));
    const int index = IndexOf({static_cast<int8_t>(edge.axis), static_cast<int8_t>(corner),
                               static_cast<int8_t>(edge.layer - cell.begin_layer)});
    return static_cast<int32_t>(first + sheets.sheet_of[index]);
  }
  const bool at_end = edge.axis != kTimeAxis && edge.layer == cell.end_layer;
  const CellSheets sheets = FindSheets(cell.inside);
  return static_cast<int32_t>(first +
                              sheets.sheet_of[CellEdge(edge.axis, corner | (at_end ? 8 : 0))]);
}

// The hexahedron of a crossed grid edge; its corners are the cells around the edge: those of the
// step `before` it and of the step `after` it; for a temporal edge, both are the edge's own. The
// normal points from inside to outside; the edges along the other three axes, in order, followed by
// the normal, have the parity of the permutation (others, axis).
mesh::Hexahedron HexahedronOf(const StepRef& before, const StepRef& after, int axis,
                              const Point& point, bool lower_end_inside) {
  std::array<int, 3> others{};
  for (int n = 0, a = 0; a < 4; ++a) {
    if (a != axis) others[n++] = a;
  }
  const int end_of_before = axis == kTimeAxis ? before.step : before.step + 1;
  mesh::Hexahedron corners;
  for (int c = 0; c < 8; ++c) {
    Point voxel = point;
    const StepRef* at = &after;
    int corner = 0;  // of the cell: the edge's lower end
    for (int n = 0; n < 3; ++n) {
      const bool upper = (c >> n & 1) != 0;
      if (others[n] == kTimeAxis) {
        at = upper ? &after : &before;
      } else if (!upper) {
        --voxel[others[n]];
        corner |= 1 << others[n];
      }
    }
    const int layer = at == &after ? after.step : end_of_before;
    corners[c] = VertexOf(*at, voxel, {axis, point, layer}, corner);
  }
  const bool even_permutation = axis == 1 || axis == kTimeAxis;
  if (even_permutation != lower_end_inside) {
    std::swap(corners[1], corners[2]);
    std::swap(corners[5], corners[6]);
  }
  return corners;
}

// Calls visit(axis, point) for each crossed spatial edge of a layer.
template <typename Visit>
void ForEachCrossedEdge(const Grid& grid, const InsideBits& layer, Visit&& visit) {
  const int num_words = grid.words_per_row();
  std::vector<uint64_t> changed(num_words);
  const auto visit_row = [&](int axis, int j, int k) {
    ForEachBit(changed.data(), num_words, [&](int i) { visit(axis, Point{i, j, k}); });
  };
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      const uint64_t* row = layer.Row(j, k);
      for (int w = 0; w < num_words; ++w) {
        const uint64_t next = w + 1 < num_words ? row[w + 1] << 63 : 0;
        changed[w] = row[w] ^ (row[w] >> 1 | next);
      }
      visit_row(0, j, k);
      if (j + 1 < grid.dims[1]) {
        const uint64_t* up = layer.Row(j + 1, k);
        for (int w = 0; w < num_words; ++w) changed[w] = row[w] ^ up[w];
        visit_row(1, j, k);
      }
      if (k + 1 < grid.dims[2]) {
        const uint64_t* up = layer.Row(j, k + 1);
        for (int w = 0; w < num_words; ++w) changed[w] = row[w] ^ up[w];
        visit_row(2, j, k);
      }
    }
  }
}

// Calls visit(point) for each point that differs between two layers.
template <typename Visit>
void ForEachChangedPoint(const Grid& grid, const InsideBits& earlier, const InsideBits& later,
                         Visit&& visit) {
  const int num_words = grid.words_per_row();
  std::vector<uint64_t> changed(num_words);
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      const uint64_t* row0 = earlier.Row(j, k);
      const uint64_t* row1 = later.Row(j, k);
      for (int w = 0; w < num_words; ++w) changed[w] = row0[w] ^ row1[w];
      ForEachBit(changed.data(), num_words, [&](int i) { visit(Point{i, j, k}); });
    }
  }
}

bool HasLayer(const SlabSteps& steps, int num_steps, int layer) {
  return layer % (steps.num_steps() / num_steps) == 0;
}

}  // namespace

void AddSpatialHexahedra(const Grid& grid, const SlabRef& before, const SlabRef& after,
                         std::vector<mesh::Hexahedron>& hexahedra) {
  CellFinder before_finder(grid, *before.slab), after_finder(grid, *after.slab);
  const StepRef last{&before, before.slab->steps.num_steps() - 1, &before_finder};
  const StepRef first{&after, 0, &after_finder};
  const InsideBits& layer = *after.layers.front();
  ForEachCrossedEdge(grid, layer, [&](int axis, const Point& p) {
    hexahedra.push_back(HexahedronOf(last, first, axis, p, layer.At(p[0], p[1], p[2])));
  });
}

void AddInnerHexahedra(const Grid& grid, const SlabRef& slab,
                       std::vector<mesh::Hexahedron>& hexahedra) {
  const SlabSteps& steps = slab.slab->steps;
  CellFinder finder(grid, *slab.slab);
  for (int num_steps = 1; num_steps <= steps.num_steps(); num_steps *= 2) {
    const int span = steps.num_steps() / num_steps;
    for (int l = 0; l < steps.num_steps(); l += span) {
      const InsideBits &earlier = *slab.layers[l], &later = *slab.layers[l + span];
      ForEachChangedPoint(grid, earlier, later, [&](const Point& p) {
        if (steps.OfPoint(p[0], p[1], p[2]) != num_steps) return;
        const StepRef step{&slab, l, &finder};
        hexahedra.push_back(HexahedronOf(step, step, kTimeAxis, p, earlier.At(p[0], p[1], p[2])));
      });
    }
  }
  for (int l = 1; l < steps.num_steps(); ++l) {
    const InsideBits& layer = *slab.layers[l];
    const StepRef before{&slab, l - 1, &finder}, after{&slab, l, &finder};
    ForEachCrossedEdge(grid, layer, [&](int axis, const Point& p) {
      if (!HasLayer(steps, steps.OfEdge(axis, p[0], p[1], p[2]), l)) return;
      hexahedra.push_back(HexahedronOf(before, after, axis, p, layer.At(p[0], p[1], p[2])));
    });
  }
}

}  // namespace liquidblend::spacetime

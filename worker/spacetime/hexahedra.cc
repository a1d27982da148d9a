#include <algorithm>
#include <cassert>
#include <utility>

#include "worker/spacetime/cell_sheets.h"
#include "worker/spacetime/surface_nets.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kTime = 3;

// The vertex of cell (i, j, k) whose sheet crosses the edge along `axis` from a corner of the cell.
// Requires: the edge is crossed.
int32_t VertexOf(const Grid& grid, const SlabRef& ref, int i, int j, int k, int axis, int corner) {
  const Slab& slab = *ref.slab;
  const int64_t row = grid.Row(j, k);
  const auto begin = slab.cell_i.begin() + slab.row_begin[row];
  const auto end = slab.cell_i.begin() + slab.row_begin[row + 1];
  const auto found = std::lower_bound(begin, end, i);
  assert(found != end && *found == i);
  const int64_t cell = found - slab.cell_i.begin();
  const int64_t vertex = ref.first_vertex + slab.first_vertex[cell];
  if (NumSheets(slab.cell_inside[cell]) == 1) return static_cast<int32_t>(vertex);
  const CellSheets sheets = FindSheets(slab.cell_inside[cell]);
  return static_cast<int32_t>(vertex + sheets.sheet_of[CellEdge(axis, corner)]);
}

// The hexahedron of the grid edge along `axis` whose lower end is point (i, j, k); its corners are
// the cells around the edge. The normal points from inside to outside; the edges along the other
// three axes, in order, followed by the normal, have the parity of the permutation (others, axis).
mesh::Hexahedron HexahedronOf(const Grid& grid, const SlabRef& before, const SlabRef& after,
                              int axis, std::array<int, 3> point, bool lower_end_inside) {
  std::array<int, 3> others{};
  for (int n = 0, a = 0; a < 4; ++a) {
    if (a != axis) others[n++] = a;
  }
  mesh::Hexahedron corners;
  for (int c = 0; c < 8; ++c) {
    std::array<int, 3> cell = point;
    const SlabRef* slab = axis == kTime ? &after : &before;
    int corner = 0;  // of the cell: the edge's lower end
    for (int n = 0; n < 3; ++n) {
      const bool upper = (c >> n & 1) != 0;
      if (!upper) corner |= 1 << others[n];
      if (others[n] == kTime) {
        slab = upper ? &after : &before;
      } else if (!upper) {
        --cell[others[n]];
      }
    }
    corners[c] = VertexOf(grid, *slab, cell[0], cell[1], cell[2], axis, corner);
  }
  const bool even_permutation = axis == 1 || axis == kTime;
  if (even_permutation != lower_end_inside) {
    std::swap(corners[1], corners[2]);
    std::swap(corners[5], corners[6]);
  }
  return corners;
}

}  // namespace

void AddSpatialHexahedra(const Grid& grid, const InsideBits& layer, const SlabRef& before,
                         const SlabRef& after, std::vector<mesh::Hexahedron>& hexahedra) {
  const int num_words = grid.words_per_row();
  std::vector<uint64_t> changed(num_words);
  const auto add = [&](int axis, int j, int k) {
    ForEachBit(changed.data(), num_words, [&](int i) {
      hexahedra.push_back(HexahedronOf(grid, before, after, axis, {i, j, k}, layer.At(i, j, k)));
    });
  };
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      const uint64_t* row = layer.Row(j, k);
      for (int w = 0; w < num_words; ++w) {
        const uint64_t next = w + 1 < num_words ? row[w + 1] << 63 : 0;
        changed[w] = row[w] ^ (row[w] >> 1 | next);
      }
      add(0, j, k);
      if (j + 1 < grid.dims[1]) {
        const uint64_t* up = layer.Row(j + 1, k);
        for (int w = 0; w < num_words; ++w) changed[w] = row[w] ^ up[w];
        add(1, j, k);
      }
      if (k + 1 < grid.dims[2]) {
        const uint64_t* up = layer.Row(j, k + 1);
        for (int w = 0; w < num_words; ++w) changed[w] = row[w] ^ up[w];
        add(2, j, k);
      }
    }
  }
}

void AddTemporalHexahedra(const Grid& grid, const InsideBits& earlier, const InsideBits& later,
                          const SlabRef& slab, std::vector<mesh::Hexahedron>& hexahedra) {
  const int num_words = grid.words_per_row();
  std::vector<uint64_t> changed(num_words);
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      const uint64_t* row0 = earlier.Row(j, k);
      const uint64_t* row1 = later.Row(j, k);
      for (int w = 0; w < num_words; ++w) changed[w] = row0[w] ^ row1[w];
      ForEachBit(changed.data(), num_words, [&](int i) {
        hexahedra.push_back(HexahedronOf(grid, slab, slab, kTime, {i, j, k}, earlier.At(i, j, k)));
      });
    }
  }
}

}  // namespace liquidblend::spacetime

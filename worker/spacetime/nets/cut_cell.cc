#include "worker/spacetime/nets/cut_cell.h"

#include <algorithm>
#include <bit>

#include "core/mesh/union_find.h"

namespace liquidblend::spacetime {
namespace {

// The two axes other than `axis`, ascending.
constexpr std::array<std::array<int, 2>, 3> kOthers = {{{1, 2}, {0, 2}, {0, 1}}};

int SpatialEdge(int axis, int lower_corner) {
  const auto [a, b] = kOthers[axis];
  return axis * 4 + (lower_corner >> a & 1) + 2 * (lower_corner >> b & 1);
}

int LowerCorner(int spatial_edge) {
  const auto [a, b] = kOthers[spatial_edge / 4];
  return (spatial_edge & 1) << a | (spatial_edge >> 1 & 1) << b;
}

// A corner of a face and the edge from it to the next one.
struct EdgeSide {
  bool inside;
  int edge;
};

class SheetFinder {
 public:
  explicit SheetFinder(const CutCell& cell) : cell_(cell), sets_(kNumCutCellEdges) {
    for (int face = 0; face < 6; ++face) {
      ForEachLayer(cell.face_layers[face], [&](int layer) { JoinSpatialFace(face, layer); });
    }
    for (int edge = 0; edge < CutCell::kNumSpatialEdges; ++edge) {
      const LayerMask layers = cell.edge_layers[edge];
      ForEachLayer(layers, [&](int layer) {
        if (layer < cell.span) JoinTemporalFace(edge, layer, NextLayer(layers, layer));
      });
    }
  }

  CutCellSheets Sheets() {
    CutCellSheets sheets;
    sheets.sheet_of.fill(-1);
    std::array<int8_t, kNumCutCellEdges> of_root;
    of_root.fill(-1);
    ForEachCrossedEdge([&](const CutCellEdge& edge) {
      const int index = IndexOf(edge);
      int8_t& sheet = of_root[sets_.Root(index)];
      if (sheet < 0) sheet = static_cast<int8_t>(sheets.count++);
      sheets.sheet_of[index] = sheet;
      sheets.crossed.push_back(edge);
    });
    return sheets;
  }

 private:
  template <typename Visit>
  static void ForEachLayer(LayerMask layers, Visit&& visit) {
    for (unsigned rest = layers; rest != 0; rest &= rest - 1) visit(std::countr_zero(rest));
  }

  bool IsInside(int corner, int layer) const {
    return (cell_.corner_inside[corner] >> layer & 1) != 0;
  }

  template <typename Visit>
  void ForEachCrossedEdge(Visit&& visit) const {
    for (int corner = 0; corner < 8; ++corner) {
      const LayerMask layers = cell_.corner_layers[corner];
      ForEachLayer(layers, [&](int layer) {
        if (layer == cell_.span) return;
        if (IsInside(corner, layer) == IsInside(corner, NextLayer(layers, layer))) return;
        visit({kTimeAxis, static_cast<int8_t>(corner), static_cast<int8_t>(layer)});
      });
    }
    for (int edge = 0; edge < CutCell::kNumSpatialEdges; ++edge) {
      const int axis = edge / 4, corner = LowerCorner(edge);
      ForEachLayer(cell_.edge_layers[edge], [&](int layer) {
        if (IsInside(corner, layer) == IsInside(corner | 1 << axis, layer)) return;
        visit({static_cast<int8_t>(axis), static_cast<int8_t>(corner), static_cast<int8_t>(layer)});
      });
    }
  }

  int SpatialIndex(int axis, int corner, int layer) const {
    return IndexOf({static_cast<int8_t>(axis), static_cast<int8_t>(corner & ~(1 << axis)),
                    static_cast<int8_t>(layer)});
  }
  int TemporalIndex(int corner, int layer) const {
    return IndexOf({kTimeAxis, static_cast<int8_t>(corner), static_cast<int8_t>(layer)});
  }

  void JoinSpatialFace(int face, int layer) {
    const auto [a, b] = kOthers[face / 2];
    const int base = (face & 1) << (face / 2);
    sides_.clear();
    sides_.push_back({IsInside(base, layer), SpatialIndex(a, base, layer)});
    sides_.push_back({IsInside(base | 1 << a, layer), SpatialIndex(b, base | 1 << a, layer)});
    sides_.push_back(
        {IsInside(base | 1 << a | 1 << b, layer), SpatialIndex(a, base | 1 << b, layer)});
    sides_.push_back({IsInside(base | 1 << b, layer), SpatialIndex(b, base, layer)});
    JoinSides();
  }

  // Up one end of the spatial edge and down the other.
  void JoinTemporalFace(int edge, int begin, int end) {
    const int axis = edge / 4, low = LowerCorner(edge), high = low | 1 << axis;
    sides_.clear();
    sides_.push_back({IsInside(low, begin), SpatialIndex(axis, low, begin)});
    for (int l = begin; l < end; l = NextLayer(cell_.corner_layers[high], l)) {
      sides_.push_back({IsInside(high, l), TemporalIndex(high, l)});
    }
    sides_.push_back({IsInside(high, end), SpatialIndex(axis, low, end)});
    const size_t top = sides_.size();
    for (int l = begin; l < end; l = NextLayer(cell_.corner_layers[low], l)) {
      sides_.push_back(
          {IsInside(low, NextLayer(cell_.corner_layers[low], l)), TemporalIndex(low, l)});
    }
    std::reverse(sides_.begin() + static_cast<std::ptrdiff_t>(top), sides_.end());
    JoinSides();
  }

  // The edge into each run of inside corners with the edge out of it.
  void JoinSides() {
    const size_t n = sides_.size();
    for (size_t s = 0; s < n; ++s) {
      if (sides_[s].inside || !sides_[(s + 1) % n].inside) continue;
      size_t last = (s + 1) % n;
      while (sides_[(last + 1) % n].inside) last = (last + 1) % n;
      sets_.Join(sides_[s].edge, sides_[last].edge);
    }
  }

  const CutCell& cell_;
  mesh::UnionFind sets_;
  std::vector<EdgeSide> sides_;
};

}  // namespace

int IndexOf(const CutCellEdge& edge) {
  if (edge.axis == kTimeAxis) return edge.corner * 8 + edge.layer;
  return 64 + SpatialEdge(edge.axis, edge.corner) * 9 + edge.layer;
}

CutCell GatherCutCell(const SlabSteps& steps, std::span<const InsideBits* const> layers, int i,
                      int j, int k, int begin) {
  CutCell cell;
  cell.span = steps.num_steps() / steps.OfVoxel(i, j, k);
  const auto layers_of = [&](int num_steps) { return steps.LayersOf(num_steps, begin, cell.span); };
  const auto ends = static_cast<LayerMask>(1u | 1u << cell.span);
  for (int corner = 0; corner < 8; ++corner) {
    const int x = i + (corner & 1), y = j + (corner >> 1 & 1), z = k + (corner >> 2);
    cell.corner_layers[corner] = layers_of(steps.OfPoint(x, y, z)) | ends;
    for (int l = 0; l <= cell.span; ++l) {
      if ((cell.corner_layers[corner] >> l & 1) == 0 || !layers[begin + l]->At(x, y, z)) continue;
      cell.corner_inside[corner] = static_cast<LayerMask>(cell.corner_inside[corner] | 1u << l);
    }
  }
  for (int edge = 0; edge < CutCell::kNumSpatialEdges; ++edge) {
    const int corner = LowerCorner(edge);
    cell.edge_layers[edge] = layers_of(steps.OfEdge(edge / 4, i + (corner & 1),
                                                    j + (corner >> 1 & 1), k + (corner >> 2))) |
                             ends;
  }
  for (int face = 0; face < 6; ++face) {
    SlabSteps::Voxel across = {i, j, k};
    across[face / 2] += (face & 1) != 0 ? 1 : -1;
    cell.face_layers[face] = layers_of(steps.Most(across, across)) | ends;
  }
  return cell;
}

CutCellSheets FindSheets(const CutCell& cell) { return SheetFinder(cell).Sheets(); }

}  // namespace liquidblend::spacetime

#include "worker/spacetime/sheets/liquid_boxes.h"

#include <algorithm>
#include <map>
#include <span>
#include <tuple>
#include <utility>

#include "worker/spacetime/nets/cell_sheets.h"
#include "worker/spacetime/nets/cut_cell.h"

namespace liquidblend::spacetime {
namespace {

using Point = std::array<int, 3>;

void SortUnique(std::vector<Point>& points) {
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
}

// Adds the inside points at the corners of a cell to those of the layers that the corners have.
void AddCorners(const Layers& layers, size_t s, const Slab::VertexBeyond& beyond,
                std::vector<std::vector<Point>>& points) {
  const Slab& slab = layers.slabs[s];
  const Slab::Cell& cell = slab.cells[beyond.cell];
  const auto row = std::upper_bound(slab.row_begin.begin(), slab.row_begin.end(), beyond.cell) -
                   slab.row_begin.begin() - 1;
  const auto j = static_cast<int>(row % layers.grid.dims[1]);
  const auto k = static_cast<int>(row / layers.grid.dims[1]);
  for (int c = 0; c < 8; ++c) {
    const int x = cell.i + (c & 1), y = j + (c >> 1 & 1), z = k + (c >> 2);
    const int apart = slab.steps.num_steps() / slab.steps.OfPoint(x, y, z);
    for (int l = cell.begin_layer; l <= cell.end_layer; ++l) {
      const int layer = layers.plan.first_layer[s] + l;
      if (l % apart == 0 && layers.inside[layer].At(x, y, z)) points[layer].push_back({x, y, z});
    }
  }
}

// With the inside points next to them.
std::vector<Point> WithNeighbors(const InsideBits& inside, const std::vector<Point>& points) {
  std::vector<Point> all = points;
  for (const Point& p : points) {
    for (int n = 0; n < 27; ++n) {
      const Point next = {p[0] + n % 3 - 1, p[1] + n / 3 % 3 - 1, p[2] + n / 9 - 1};
      if (inside.At(next[0], next[1], next[2])) all.push_back(next);
    }
  }
  SortUnique(all);
  return all;
}

class FaceFinder {
 public:
  FaceFinder(const Layers& layers, int layer) : layers_(layers) { faces_.layer = layer; }

  BoxFaces Find(const std::vector<Point>& points) {
    for (const Point& p : points) {
      for (int axis = 0; axis < 3; ++axis) {
        for (int side = 0; side < 2; ++side) {
          Point next = p;
          next[axis] += 2 * side - 1;
          if (!std::binary_search(points.begin(), points.end(), next)) AddFace(p, axis, side);
        }
      }
    }
    return std::move(faces_);
  }

 private:
  void AddFace(const Point& p, int axis, int side) {
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
    std::array<int, 4> face = {CornerOf(p, base), CornerOf(p, base | u), CornerOf(p, base | u | v),
                               CornerOf(p, base | v)};
    if (side == 0) std::swap(face[1], face[3]);
    faces_.faces.push_back(face);
  }

  // The number of corner c of the point's box; bits x, y, z: the upper ones.
  int CornerOf(const Point& p, int c) {
    const Point voxel = {p[0] - 1 + (c & 1), p[1] - 1 + (c >> 1 & 1), p[2] - 1 + (c >> 2)};
    const BoxCorner before = VertexOf(voxel, faces_.layer - 1, c ^ 7);
    const BoxCorner after = VertexOf(voxel, faces_.layer, c ^ 7);
    const auto [found, added] = numbers_.try_emplace({voxel, before.vertex, after.vertex},
                                                     static_cast<int>(faces_.before.size()));
    if (added) {
      faces_.before.push_back(before);
      faces_.after.push_back(after);
    }
    return found->second;
  }

  // The vertex of the voxel's cell after layer `begin`, of the sheet at the cell's corner `at`.
  BoxCorner VertexOf(const Point& voxel, int begin, int at) const {
    BoxCorner corner;
    corner.slab = layers_.SlabOf(begin);
    const Slab& slab = layers_.slabs[corner.slab];
    const int step = begin - layers_.plan.first_layer[corner.slab];
    const Slab::Cell* cell = FindCell(layers_.grid, slab, step, voxel[0], voxel[1], voxel[2]);
    const int sheet = cell == nullptr ? -1 : SheetOf(corner.slab, *cell, voxel, at);
    if (sheet >= 0) {
      corner.vertex = cell->first_vertex + sheet;
      return corner;
    }
    const auto& times = layers_.plan.layers;
    corner.place.head<3>() =
        Eigen::Vector3i(voxel[0], voxel[1], voxel[2]).cast<float>().array() + 0.5f;
    corner.place.w() = static_cast<float>(0.5 * (times[begin].time + times[begin + 1].time));
    return corner;
  }

  // The sheet that crosses edges from the cell's corner `at`, which a face of the cell joins; the
  // cell's only one, if none of them is crossed; -1: which one does not matter.
  int SheetOf(int s, const Slab::Cell& cell, const Point& voxel, int at) const {
    if (cell.num_sheets == 1) return 0;
    const int layer = faces_.layer - layers_.plan.first_layer[s];
    if (cell.is_cut) return SheetOfCut(s, cell, voxel, at, layer - cell.begin_layer);
    const CellSheets sheets = FindSheets(cell.inside);
    const int corner = at | (layer == cell.end_layer ? 8 : 0);
    for (int axis = 0; axis < 4; ++axis) {
      const int sheet = sheets.sheet_of[CellEdge(axis, corner & ~(1 << axis))];
      if (sheet >= 0) return sheet;
    }
    return -1;
  }

  int SheetOfCut(int s, const Slab::Cell& cell, const Point& voxel, int at, int layer) const {
    std::vector<const InsideBits*> inside;
    for (int l = layers_.plan.first_layer[s]; l <= layers_.plan.first_layer[s + 1]; ++l) {
      inside.push_back(&layers_.inside[l]);
    }
    const CutCell cut = GatherCutCell(layers_.slabs[s].steps, inside, voxel[0], voxel[1], voxel[2],
                                      cell.begin_layer);
    const CutCellSheets sheets = FindSheets(cut);
    for (const CutCellEdge& edge : sheets.crossed) {
      const bool touches =
          edge.axis == kTimeAxis
              ? edge.corner == at &&
                    (edge.layer == layer || NextLayer(cut.corner_layers[at], edge.layer) == layer)
              : edge.layer == layer && (edge.corner | 1 << edge.axis) == (at | 1 << edge.axis);
      if (touches) return sheets.sheet_of[IndexOf(edge)];
    }
    return -1;
  }

  const Layers& layers_;
  BoxFaces faces_;
  std::map<std::tuple<Point, int32_t, int32_t>, int> numbers_;
};

}  // namespace

std::vector<BoxFaces> FindBoxFaces(const Layers& layers, const parallel::Arena& arena) {
  const size_t num_layers = layers.inside.size();
  std::vector<std::vector<Point>> points(num_layers);
  for (size_t s = 0; s < layers.slabs.size(); ++s) {
    for (const Slab::VertexBeyond& beyond : layers.slabs[s].beyond) {
      AddCorners(layers, s, beyond, points);
    }
  }
  // The first and the last layer are no slice's.
  std::vector<BoxFaces> faces(num_layers);
  arena.Run(static_cast<int64_t>(num_layers) - 2, [&](int64_t n) {
    const auto l = static_cast<int>(n) + 1;
    SortUnique(points[l]);
    faces[l] = FaceFinder(layers, l).Find(WithNeighbors(layers.inside[l], points[l]));
  });
  std::erase_if(faces, [](const BoxFaces& of_layer) { return of_layer.faces.empty(); });
  return faces;
}

}  // namespace liquidblend::spacetime

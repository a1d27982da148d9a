#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "core/mesh/marching_table.h"
#include "server/slice/slice.h"

namespace liquidblend::slice {
namespace {

using Point = std::array<float, 3>;

float DistanceSq(const Point& a, const Point& b) {
  const float x = a[0] - b[0];
  const float y = a[1] - b[1];
  const float z = a[2] - b[2];
  return x * x + y * y + z * z;
}

// A loop of one cell that is being cut into triangles.
struct Polygon {
  int size = 0;
  std::array<int32_t, mesh::kMaxEdges> vertices;   // output vertices
  std::array<int8_t, mesh::kMaxEdges> cell_edges;  // that they lie on
  int8_t edge(int k) const { return cell_edges[(k + size) % size]; }
  int32_t vertex(int k) const { return vertices[(k + size) % size]; }

  void Remove(int k) {
    for (int i = k; i + 1 < size; ++i) {
      vertices[i] = vertices[i + 1];
      cell_edges[i] = cell_edges[i + 1];
    }
    --size;
  }
};

// Cuts cells, cluster by cluster, into the workspace's buffers.
class Marcher {
 public:
  Marcher(std::span<const mesh::Float4> positions, Workspace& workspace)
      : positions_(positions.data()), workspace_(workspace) {
    const auto count = static_cast<size_t>(workspace.num_vertices);
    workspace.first_crossing.assign(count, -1);
    if (workspace.is_later.size() < count) workspace.is_later.resize(count);
    for (size_t i = 0; i < count; ++i) {
      workspace.is_later[i] = static_cast<double>(positions[i][3]) >= workspace.time_frames;
    }
  }

  // Cuts those candidate clusters that are of this kind.
  template <typename Cell, int kCorners>
  void MarchKind(const SortedCells<Cell>& sorted, const mesh::MarchingTable<kCorners>& table) {
    static_assert(std::tuple_size_v<Cell> == kCorners);
    const auto num_cells = static_cast<int64_t>(sorted.cells.size());
    const auto end_cluster =
        sorted.first_cluster +
        static_cast<int32_t>((num_cells + kCellsPerCluster - 1) / kCellsPerCluster);
    const auto& clusters = workspace_.clusters;
    const auto first = std::lower_bound(clusters.begin(), clusters.end(), sorted.first_cluster);
    for (auto it = first; it != clusters.end() && *it < end_cluster; ++it) {
      const int64_t begin = int64_t{*it - sorted.first_cluster} * kCellsPerCluster;
      const int64_t end = std::min(num_cells, begin + kCellsPerCluster);
      MakeRoom();
      for (int64_t c = begin; c < end; ++c) MarchCell(sorted.cells[c], table);
    }
  }

  mesh::TriangleMesh Result() const {
    mesh::TriangleMesh surface;
    surface.vertices.resize(3, num_vertices_);
    surface.triangles.resize(3, num_triangles_);
    std::copy_n(workspace_.vertices.begin(), num_vertices_,
                reinterpret_cast<Point*>(surface.vertices.data()));
    std::copy_n(workspace_.triangles.begin(), num_triangles_,
                reinterpret_cast<std::array<int32_t, 3>*>(surface.triangles.data()));
    return surface;
  }

 private:
  // One cluster cannot add more than this, so that cells need not ask for room one by one.
  void MakeRoom() {
    constexpr size_t kMost = kCellsPerCluster * mesh::kMaxEdges;
    if (num_vertices_ + kMost > workspace_.vertices.size()) {
      const size_t size = 2 * (num_vertices_ + kMost);
      workspace_.vertices.resize(size);
      workspace_.near_vertex.resize(size);
      workspace_.far_vertex.resize(size);
      workspace_.next_crossing.resize(size);
    }
    if (num_triangles_ + kMost > workspace_.triangles.size()) {
      workspace_.triangles.resize(2 * (num_triangles_ + kMost));
    }
  }

  template <typename Cell, int kCorners>
  void MarchCell(const Cell& cell, const mesh::MarchingTable<kCorners>& table) {
    std::array<int32_t, kCorners> slots;  // of the corners, among the blended vertices
    unsigned code = 0;
    for (int k = 0; k < kCorners; ++k) {
      const auto v = static_cast<uint32_t>(cell[k]);
      slots[k] = workspace_.block_offset[v / kVerticesPerBlock] +
                 static_cast<int32_t>(v % kVerticesPerBlock);
      code |= static_cast<unsigned>(workspace_.is_later[slots[k]]) << k;
    }
    const mesh::Case& cut = table.cases[code];
    const int8_t* cell_edge = cut.edges.data();
    for (int loop = 0; loop < cut.num_loops; ++loop) {
      Polygon polygon;
      polygon.size = cut.loop_size[loop];
      for (int k = 0; k < polygon.size; ++k, ++cell_edge) {
        const auto& corners = table.edges[*cell_edge];
        polygon.cell_edges[k] = *cell_edge;
        polygon.vertices[k] = CrossingOf(slots[corners[0]], slots[corners[1]]);
      }
      AddPolygon(polygon, table.facet_mates);
    }
  }

  // The output vertex on a crossed mesh edge. Blended vertices are in the order of the family's, so
  // their slots tell the lower vertex; its crossings are a list, usually of one to three.
  int32_t CrossingOf(int32_t slot_a, int32_t slot_b) {
    const auto [low, high] = std::minmax(slot_a, slot_b);
    int32_t& head = workspace_.first_crossing[low];
    for (int32_t v = head; v >= 0; v = workspace_.next_crossing[v]) {
      if (workspace_.far_vertex[v] == high) return v;
    }
    const auto v = static_cast<int32_t>(num_vertices_++);
    workspace_.near_vertex[v] = low;
    workspace_.far_vertex[v] = high;
    workspace_.next_crossing[v] = head;
    head = v;
    workspace_.vertices[v] = Interpolate(positions_[low], positions_[high]);
    return v;
  }

  // Exactly one end where its time is the slice's.
  Point Interpolate(const mesh::Float4& a, const mesh::Float4& b) const {
    const double s = (workspace_.time_frames - a[3]) / (static_cast<double>(b[3]) - a[3]);
    const double r = 1.0 - s;
    return {static_cast<float>(r * a[0] + s * b[0]), static_cast<float>(r * a[1] + s * b[1]),
            static_cast<float>(r * a[2] + s * b[2])};
  }

  void AddPolygon(Polygon& polygon, const std::array<uint16_t, mesh::kMaxEdges>& facet_mates) {
    const auto& v = polygon.vertices;
    if (polygon.size == 3) return AddTriangle(v[0], v[1], v[2]);
    if (polygon.size == 4) return AddQuad(v[0], v[1], v[2], v[3]);
    while (polygon.size > 3) {
      const int ear = BestEar(polygon, facet_mates);
      AddTriangle(polygon.vertex(ear - 1), polygon.vertex(ear), polygon.vertex(ear + 1));
      polygon.Remove(ear);
    }
    AddTriangle(v[0], v[1], v[2]);
  }

  void AddQuad(int32_t a, int32_t b, int32_t c, int32_t d) {
    const auto& points = workspace_.vertices;
    if (DistanceSq(points[a], points[c]) <= DistanceSq(points[b], points[d])) {
      AddTriangle(a, b, c);
      AddTriangle(a, c, d);
    } else {
      AddTriangle(a, b, d);
      AddTriangle(b, c, d);
    }
  }

  // The ear with the shortest base; a base inside of a facet, which the neighbour might choose as
  // well (four triangles on one edge), only if there is no other.
  int BestEar(const Polygon& polygon,
              const std::array<uint16_t, mesh::kMaxEdges>& facet_mates) const {
    const auto& points = workspace_.vertices;
    int best = 0;
    auto best_cost = std::pair(true, std::numeric_limits<float>::infinity());
    for (int k = 0; k < polygon.size; ++k) {
      const bool is_in_facet = (facet_mates[polygon.edge(k - 1)] >> polygon.edge(k + 1) & 1) != 0;
      const float base_sq =
          DistanceSq(points[polygon.vertex(k - 1)], points[polygon.vertex(k + 1)]);
      const auto cost = std::pair(is_in_facet, base_sq);
      if (cost < best_cost) {
        best = k;
        best_cost = cost;
      }
    }
    return best;
  }

  // A cell with a corner twice can name a vertex twice; left out, such a triangle leaves no gap.
  void AddTriangle(int32_t a, int32_t b, int32_t c) {
    if (a == b || b == c || c == a) return;
    workspace_.triangles[num_triangles_++] = {a, b, c};
  }

  const mesh::Float4* positions_;
  Workspace& workspace_;
  size_t num_vertices_ = 0;
  size_t num_triangles_ = 0;
};

}  // namespace

mesh::TriangleMesh March(const CellIndex& index, std::span<const mesh::Float4> positions,
                         Workspace& workspace) {
  assert(static_cast<int64_t>(positions.size()) >= workspace.num_vertices);
  Marcher marcher(positions, workspace);
  marcher.MarchKind(index.tetrahedra(), mesh::kTetrahedronTable);
  marcher.MarchKind(index.pyramids(), mesh::kPyramidTable);
  marcher.MarchKind(index.wedges(), mesh::kWedgeTable);
  marcher.MarchKind(index.hexahedra(), mesh::kHexahedronTable);
  return marcher.Result();
}

}  // namespace liquidblend::slice

#include "core/slice/cut_cluster.h"

#include <algorithm>
#include <bit>

namespace liquidblend::slice {
namespace {

// Number of corners that is copied for every cell. Most cells that are cut have no more.
constexpr int kUsualCorners = 6;

void SetBit(int v, bool value, VertexBits& bits) {
  const unsigned bit = 1U << v % 8;
  const unsigned others = bits[v / 8] & ~bit;
  bits[v / 8] = static_cast<uint8_t>(value ? others | bit : others);
}

// Calls visit(k) for each member k of the set, ascending.
template <typename Visit>
void ForEachIn(uint64_t set, Visit&& visit) {
  for (; set != 0; set &= set - 1) visit(std::countr_zero(set));
}

}  // namespace

bool CutCluster::Cut(const Cluster& cluster, std::span<const TimeTerm> terms, float first_later) {
  cluster_ = cluster;
  FindSigns(terms, first_later);
  switch (cluster.kind) {
    case CellKind::kTetrahedron:
      return CutCells(mesh::kTetrahedronTable);
    case CellKind::kPyramid:
      return CutCells(mesh::kPyramidTable);
    case CellKind::kWedge:
      return CutCells(mesh::kWedgeTable);
    case CellKind::kHexahedron:
      return CutCells(mesh::kHexahedronTable);
  }
  return false;
}

// Finds the vertices that are later than the slice.
void CutCluster::FindSigns(std::span<const TimeTerm> terms, float first_later) {
  const auto num_vertices = static_cast<int>(cluster_.vertices.size());
  FindLater(cluster_.times, num_vertices, terms, first_later, is_later_);
  for (int v = 0; v < cluster_.num_first_vertices; ++v) SetBit(v, false, is_later_);
  for (int v = num_vertices - cluster_.num_last_vertices; v < num_vertices; ++v) {
    SetBit(v, true, is_later_);
  }
}

template <int kCorners>
bool CutCluster::CutCells(const mesh::MarchingTable<kCorners>& table) {
  const uint64_t cells =
      FindCodes(is_later_, cluster_.corners, kCorners, cluster_.num_cells, codes_.data());
  if (cells == 0) return false;
  ListCrossings();
  facet_mates_ = &table.facet_mates;
  AddLoops(table, cells);
  return true;
}

// Lists the crossed edges. Every edge belongs to a cell of the cluster, so these are the edges of
// the cells that are cut.
void CutCluster::ListCrossings() {
  FindCrossed(is_later_, cluster_.low_ends, cluster_.high_ends, cluster_.num_edges, crossed_.edges);
  int n = 0;
  for (size_t word = 0; word < crossed_.edges.size(); ++word) {
    crossed_.num_before_word[word] = static_cast<uint8_t>(n);
    ForEachIn(crossed_.edges[word], [&](int bit) {
      const auto edge = static_cast<uint8_t>(64 * word + bit);
      edges_[n] = edge;
      crossing_of_edge_[edge] = static_cast<uint8_t>(n);
      near_[n] = cluster_.vertices[cluster_.low_ends[edge]];
      far_[n] = cluster_.vertices[cluster_.high_ends[edge]];
      ++n;
    });
  }
  num_crossings_ = n;
  num_own_ = crossed_.NumBefore(cluster_.num_own_edges);
}

// Adds the loops of the cells that are cut. Counts are local variables, since the compiler must
// assume that written bytes may alias members.
template <int kCorners>
void CutCluster::AddLoops(const mesh::MarchingTable<kCorners>& table, uint64_t cells) {
  int begin = 0;
  std::array<int, 3> num_loops = {};
  ForEachIn(cells, [&](int cell) {
    const mesh::Case& cut = table.cases[codes_[cell]];
    const uint8_t* edges = cluster_.edges + cell * table.num_edges;
    uint8_t* corner = corners_.data() + begin;
    const int8_t* cell_edge = cut.edges.data();
    for (int k = 0; k < kUsualCorners; ++k) corner[k] = crossing_of_edge_[edges[cell_edge[k]]];
    for (int k = kUsualCorners; k < cut.num_edges; ++k) {
      corner[k] = crossing_of_edge_[edges[cell_edge[k]]];
    }
    for (int loop = 0; loop < cut.num_loops; ++loop) {
      const int size = cut.loop_size[loop];
      const int size_class = std::min(size - 3, 2);
      loops_[size_class][num_loops[size_class]++] = {begin, size, cell_edge};
      begin += size;
      cell_edge += size;
    }
  });
  num_loops_ = num_loops;
}

}  // namespace liquidblend::slice

#include "server/slice/cut_cluster.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace liquidblend::slice {
namespace {

constexpr uint8_t kNone = 255;
static_assert(kMaxClusterEdges <= kNone);

void SetBit(int v, bool value, VertexBits& bits) {
  const unsigned bit = 1U << v % 8;
  const unsigned others = bits[v / 8] & ~bit;
  bits[v / 8] = static_cast<uint8_t>(value ? others | bit : others);
}

int NumSet(const VertexBits& bits) {
  std::array<uint64_t, 2> words;
  static_assert(sizeof(words) == sizeof(bits));
  std::memcpy(words.data(), bits.data(), sizeof(words));
  return std::popcount(words[0]) + std::popcount(words[1]);
}

}  // namespace

bool CutCluster::Cut(const Cluster& cluster, std::span<const TimeTerm> terms, float first_later) {
  cluster_ = cluster;
  if (!FindSigns(terms, first_later)) return false;
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

// Which vertices are later than the slice; false if they all are, or none.
bool CutCluster::FindSigns(std::span<const TimeTerm> terms, float first_later) {
  const auto num_vertices = static_cast<int>(cluster_.vertices.size());
  FindLater(cluster_.times, num_vertices, terms, first_later, is_later_);
  for (int v = 0; v < cluster_.num_first_vertices; ++v) SetBit(v, false, is_later_);
  for (int v = num_vertices - cluster_.num_last_vertices; v < num_vertices; ++v) {
    SetBit(v, true, is_later_);
  }
  const int num_later = NumSet(is_later_);
  return num_later != 0 && num_later != num_vertices;
}

// Counts are local while lists of bytes are written, which might be anything's for the compiler.
template <int kCorners>
bool CutCluster::CutCells(const mesh::MarchingTable<kCorners>& table) {
  constexpr unsigned kAllLater = (1U << kCorners) - 1;
  FindCodes(is_later_, cluster_.corners, kCorners, cluster_.num_cells, codes_.data());
  std::array<uint8_t, kMaxClusterCells + 1> cut_cells;
  int num_cut = 0;
  for (int c = 0; c < cluster_.num_cells; ++c) {
    cut_cells[num_cut] = static_cast<uint8_t>(c);
    num_cut += codes_[c] != 0 && codes_[c] != kAllLater ? 1 : 0;
  }
  AddLoops(table, std::span(cut_cells).first(num_cut));
  AddCrossings(table, std::span(cut_cells).first(num_cut));
  int num_own = 0;
  for (int k = 0; k < num_crossings_; ++k) {
    own_[num_own] = shared_[k - num_own] = static_cast<uint8_t>(k);
    num_own += static_cast<int>(crossings_[k].edge < cluster_.num_own_edges);
  }
  num_own_ = num_own;
  table_edges_ = &table.edges;
  for (int i = 0; i < num_own; ++i) {
    const auto [low, high] = EndsOf(crossings_[own_[i]]);
    near_[i] = cluster_.vertices[low];
    far_[i] = cluster_.vertices[high];
  }
  facet_mates_ = &table.facet_mates;
  return num_cut > 0;
}

template <int kCorners>
void CutCluster::AddLoops(const mesh::MarchingTable<kCorners>& table,
                          std::span<const uint8_t> cells) {
  int begin = 0;
  int num_quads = 0;
  int num_triangles = 0;
  num_polygons_ = 0;
  for (const uint8_t cell : cells) {
    const mesh::Case& cut = table.cases[codes_[cell]];
    const int first = begin;
    for (int loop = 0; loop < cut.num_loops; ++loop) {
      const int size = cut.loop_size[loop];
      quads_[num_quads] = triangles_[num_triangles] = static_cast<int16_t>(begin);
      num_quads += size == 4 ? 1 : 0;
      num_triangles += size == 3 ? 1 : 0;
      if (size > 4) polygons_[num_polygons_++] = {begin, size, &cut.edges[begin - first]};
      begin += size;
    }
  }
  num_quads_ = num_quads;
  num_triangles_ = num_triangles;
}

template <int kCorners>
void CutCluster::AddCrossings(const mesh::MarchingTable<kCorners>& table,
                              std::span<const uint8_t> cells) {
  std::array<uint8_t, kMaxClusterEdges> crossing_of_edge;
  std::fill_n(crossing_of_edge.begin(), cluster_.num_edges, kNone);
  int num_crossings = 0;
  uint8_t* corner = corners_.data();
  for (const uint8_t cell : cells) {
    const mesh::Case& cut = table.cases[codes_[cell]];
    const int num_edges = cut.num_edges;
    const uint8_t* edges = cluster_.edges + cell * table.num_edges;
    for (int k = 0; k < num_edges; ++k) {
      const uint8_t edge = edges[cut.edges[k]];
      const int known = crossing_of_edge[edge];
      const int is_new = known == kNone ? 1 : 0;
      crossings_[num_crossings] = {edge, cell, cut.edges[k]};
      const auto crossing = static_cast<uint8_t>(known + is_new * (num_crossings - known));
      num_crossings += is_new;
      crossing_of_edge[edge] = *corner++ = crossing;
    }
  }
  num_crossings_ = num_crossings;
}

}  // namespace liquidblend::slice

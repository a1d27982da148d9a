#include "core/slice/cluster_builder.h"

#include <algorithm>
#include <numeric>

#include "core/mesh/marching_table.h"
#include "core/slice/cell_order.h"

namespace liquidblend::slice {
namespace {

const auto& TableOf(const mesh::Tetrahedron&) { return mesh::kTetrahedronTable; }
const auto& TableOf(const mesh::Pyramid&) { return mesh::kPyramidTable; }
const auto& TableOf(const mesh::Wedge&) { return mesh::kWedgeTable; }
const auto& TableOf(const mesh::Hexahedron&) { return mesh::kHexahedronTable; }

}  // namespace

ClusterBuilder::ClusterBuilder(const mesh::RegisteredFamily& family, CellIndex& index)
    : num_vertices_(static_cast<int64_t>(family.vertices.size())),
      index_(index),
      first_edge_(num_vertices_, -1),
      growing_number_(num_vertices_, -1),
      edge_numbers_(size_t{kMaxClusterVertices} * kMaxClusterVertices, 0) {}

template <typename Cell>
void ClusterBuilder::Add(std::span<const Cell> cells, CellKind kind) {
  uint64_t slab = 0;
  for (const OrderedCell& ordered : OrderCells(*index_.family_, cells)) {
    const Cell& cell = cells[ordered.cell];
    if (ordered.slab() != slab) Finish(kind);
    slab = ordered.slab();
    if (Grow(cell, TableOf(cell))) continue;
    Finish(kind);
    Grow(cell, TableOf(cell));
  }
  Finish(kind);
}

// Adds a cell to the cluster. Returns false, with the cluster unchanged, if it would become too
// large.
template <typename Cell, typename Table>
bool ClusterBuilder::Grow(const Cell& cell, const Table& table) {
  Growing& growing = growing_;
  if (growing.num_cells == kMaxClusterCells ||
      growing.num_edges + table.num_edges > kMaxClusterEdges) {
    return false;
  }
  const auto num_new =
      std::count_if(cell.begin(), cell.end(), [this](int32_t v) { return growing_number_[v] < 0; });
  if (growing.num_vertices + num_new > kMaxClusterVertices) return false;
  std::array<uint8_t, std::tuple_size_v<Cell>> corners;
  for (size_t k = 0; k < cell.size(); ++k) {
    int16_t& number = growing_number_[cell[k]];
    if (number < 0) {
      number = static_cast<int16_t>(growing.num_vertices);
      growing.vertices[growing.num_vertices++] = cell[k];
    }
    corners[k] = static_cast<uint8_t>(number);
  }
  growing.cell_corners.insert(growing.cell_corners.end(), corners.begin(), corners.end());
  for (int e = 0; e < table.num_edges; ++e) {
    const auto& ends = table.edges[e];
    growing.cell_edges.push_back(EdgeNumber(corners[ends[0]], corners[ends[1]]));
  }
  for (size_t k = 1; k < corners.size(); ++k) {
    const auto before = corners.begin() + k;
    if (std::find(corners.begin(), before, corners[k]) != before) {
      growing.has_repeated_corners = true;
    }
  }
  ++growing.num_cells;
  return true;
}

uint8_t ClusterBuilder::EdgeNumber(uint8_t a, uint8_t b) {
  const auto [low, high] = std::minmax(a, b);
  uint8_t& number = edge_numbers_[low * kMaxClusterVertices + high];
  if (number == 0) {
    growing_.edges[growing_.num_edges++] = {low, high};
    number = static_cast<uint8_t>(growing_.num_edges);
  }
  return static_cast<uint8_t>(number - 1);
}

void ClusterBuilder::Finish(CellKind kind) {
  if (growing_.num_cells == 0) return;
  for (const auto& [low, high] : std::span(growing_.edges).first(growing_.num_edges)) {
    edge_numbers_[low * kMaxClusterVertices + high] = 0;
  }
  for (const int32_t v : std::span(growing_.vertices).first(growing_.num_vertices)) {
    growing_number_[v] = -1;
  }
  SortVertices();
  CellIndex::Record record;
  record.first_byte = static_cast<int64_t>(index_.bytes_.size());
  record.first_vertex = static_cast<int64_t>(index_.vertices_.size());
  record.first_owner = static_cast<int64_t>(index_.owner_clusters_.size());
  record.kind = kind;
  record.num_cells = static_cast<uint8_t>(growing_.num_cells);
  record.num_vertices = static_cast<uint8_t>(growing_.num_vertices);
  record.num_edges = static_cast<uint8_t>(growing_.num_edges);
  record.has_repeated_corners = growing_.has_repeated_corners;
  ShareEdges(record);
  index_.records_.push_back(record);
  auto& bytes = index_.bytes_;
  const size_t num_corners = growing_.cell_corners.size() / growing_.num_cells;
  for (size_t k = 0; k < num_corners; ++k) {
    for (int c = 0; c < growing_.num_cells; ++c) {
      bytes.push_back(growing_.cell_corners[c * num_corners + k]);
    }
  }
  bytes.insert(bytes.end(), growing_.cell_edges.begin(), growing_.cell_edges.end());
  const auto edges = std::span(growing_.edges).first(growing_.num_edges);
  for (const auto& [low, high] : edges) bytes.push_back(low);
  for (const auto& [low, high] : edges) bytes.push_back(high);
  index_.vertices_.insert(index_.vertices_.end(), growing_.vertices.begin(),
                          growing_.vertices.begin() + growing_.num_vertices);
  growing_.num_vertices = growing_.num_edges = growing_.num_cells = 0;
  growing_.has_repeated_corners = false;
  growing_.cell_corners.clear();
  growing_.cell_edges.clear();
}

// Numbers the vertices in the family's order, so that an edge's lower vertex is the same in all
// clusters.
void ClusterBuilder::SortVertices() {
  Growing& growing = growing_;
  const auto vertices = std::span(growing.vertices).first(growing.num_vertices);
  std::array<uint8_t, kMaxClusterVertices> order;  // old numbers, in the new order
  std::iota(order.begin(), order.begin() + growing.num_vertices, uint8_t{0});
  std::sort(order.begin(), order.begin() + growing.num_vertices,
            [&](uint8_t a, uint8_t b) { return vertices[a] < vertices[b]; });
  std::array<uint8_t, kMaxClusterVertices> number;  // new ones, by old ones
  for (int k = 0; k < growing.num_vertices; ++k) number[order[k]] = static_cast<uint8_t>(k);
  std::sort(vertices.begin(), vertices.end());
  for (uint8_t& corner : growing.cell_corners) corner = number[corner];
  for (auto& [low, high] : std::span(growing.edges).first(growing.num_edges)) {
    const auto [a, b] = std::minmax({number[low], number[high]});
    low = a;
    high = b;
  }
}

// Finds the edges that other clusters have already; the remaining ones are the cluster's own and
// come first.
void ClusterBuilder::ShareEdges(CellIndex::Record& record) {
  const auto cluster = static_cast<int32_t>(index_.records_.size());
  std::array<uint8_t, kMaxClusterEdges> number;
  std::array<const Edge*, kMaxClusterEdges> found;
  int num_own = 0;
  for (int e = 0; e < growing_.num_edges; ++e) {
    const auto& [low, high] = growing_.edges[e];
    found[e] = Find(growing_.vertices[low], growing_.vertices[high]);
    if (found[e] == nullptr) number[e] = static_cast<uint8_t>(num_own++);
  }
  int num_shared = 0;
  for (int e = 0; e < growing_.num_edges; ++e) {
    if (found[e] == nullptr) continue;
    number[e] = static_cast<uint8_t>(num_own + num_shared++);
    index_.owner_clusters_.push_back(found[e]->cluster);
    index_.owner_edges_.push_back(found[e]->number);
  }
  for (int e = 0; e < growing_.num_edges; ++e) {
    if (found[e] != nullptr) continue;
    const auto& [low, high] = growing_.edges[e];
    int32_t& first = first_edge_[growing_.vertices[low]];
    edges_.push_back({growing_.vertices[high], cluster, first, number[e]});
    first = static_cast<int32_t>(edges_.size() - 1);
  }
  for (uint8_t& edge : growing_.cell_edges) edge = number[edge];
  const auto edges = growing_.edges;
  for (int e = 0; e < growing_.num_edges; ++e) growing_.edges[number[e]] = edges[e];
  record.num_own_edges = static_cast<uint8_t>(num_own);
}

ClusterBuilder::Edge* ClusterBuilder::Find(int32_t low, int32_t high) {
  for (int32_t e = first_edge_[low]; e >= 0; e = edges_[e].next) {
    if (edges_[e].high_vertex == high) return &edges_[e];
  }
  return nullptr;
}

template void ClusterBuilder::Add(std::span<const mesh::Tetrahedron>, CellKind);
template void ClusterBuilder::Add(std::span<const mesh::Pyramid>, CellKind);
template void ClusterBuilder::Add(std::span<const mesh::Wedge>, CellKind);
template void ClusterBuilder::Add(std::span<const mesh::Hexahedron>, CellKind);

}  // namespace liquidblend::slice

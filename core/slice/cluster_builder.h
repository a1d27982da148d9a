// Builder of the clusters of a CellIndex.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/registered_family.h"
#include "core/slice/cell_index.h"

namespace liquidblend::slice {

// Adds one kind of cells after another to the index, without bounds of times.
class ClusterBuilder {
 public:
  // Starts an empty index.  Requires: both outlive this.
  ClusterBuilder(const mesh::RegisteredFamily& family, CellIndex& index);

  template <typename Cell>
  void Add(std::span<const Cell> cells, CellKind kind);

 private:
  // An edge of the family, in the list of edges with the same lower vertex.
  struct Edge {
    int32_t high_vertex;
    int32_t cluster;  // that it belongs to
    int32_t next;     // of the list; -1: the last
    uint8_t number;   // in the cluster
  };

  // The cluster that grows. Its vertices are numbered as they come; an edge is that of two numbers.
  struct Growing {
    std::array<int32_t, kMaxClusterVertices> vertices;
    int num_vertices = 0;
    std::array<std::array<uint8_t, 2>, kMaxClusterEdges> edges;
    int num_edges = 0;
    std::vector<uint8_t> cell_corners;  // per cell
    std::vector<uint8_t> cell_edges;
    int num_cells = 0;
    bool has_repeated_corners = false;
  };

  template <typename Cell, typename Table>
  bool Grow(const Cell& cell, const Table& table);
  uint8_t EdgeNumber(uint8_t a, uint8_t b);
  void Finish(CellKind kind);
  void SortVertices();
  void ShareEdges(CellIndex::Record& record);
  Edge* Find(int32_t low, int32_t high);

  const int64_t num_vertices_;
  CellIndex& index_;
  std::vector<Edge> edges_;
  std::vector<int32_t> first_edge_;  // per vertex of the family
  std::vector<int16_t>
      growing_number_;                 // per vertex of the family: in the cluster that grows, or -1
  std::vector<uint8_t> edge_numbers_;  // per pair of numbers: its edge + 1, or 0
  Growing growing_;
};

}  // namespace liquidblend::slice

// One cluster of cells, cut at a time: which edges are crossed, and how the crossings are linked.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "core/mesh/marching_table.h"
#include "server/slice/cell_index.h"
#include "server/slice/cluster_kernel.h"

namespace liquidblend::slice {

// A crossed edge of a cluster, and one of the cells that have it.
struct Crossing {
  uint8_t edge;
  uint8_t cell;
  int8_t cell_edge;  // as the marching table numbers them
};

// A closed polygon of five corners or more.
struct Loop {
  int begin;  // its first corner
  int size;
  const int8_t* cell_edges;  // that its corners lie on
};

// Keeps its memory, so that there is one for many clusters. Few of its branches depend on data:
// mispredicted ones would take most of the time.  Threads: one at a time.
class CutCluster {
 public:
  // Returns false if no cell is cut.
  //   first_later  the first time that is not before the slice
  bool Cut(const Cluster& cluster, std::span<const TimeTerm> terms, float first_later);

  // The following are those of the last cut.
  const Cluster& cluster() const { return cluster_; }
  // Each crossed edge once, in the order of their first use.
  std::span<const Crossing> crossings() const {
    return std::span(crossings_).first(num_crossings_);
  }
  // Those on edges that belong to this cluster, and the others.
  std::span<const uint8_t> own() const { return std::span(own_).first(num_own_); }
  std::span<const uint8_t> shared() const {
    return std::span(shared_).first(num_crossings_ - num_own_);
  }
  // Its vertices in the cluster, the lower one first.
  std::array<uint8_t, 2> EndsOf(const Crossing& crossing) const {
    const auto& ends = (*table_edges_)[crossing.cell_edge];
    const uint8_t* corners = cluster_.corners + crossing.cell;
    const uint8_t a = corners[ends[0] * cluster_.num_cells];
    const uint8_t b = corners[ends[1] * cluster_.num_cells];
    return {std::min(a, b), std::max(a, b)};
  }
  // Per crossing of own(): the ends of its edge, as vertices of the family.
  std::span<const int32_t> near_vertices() const { return std::span(near_).first(num_own_); }
  std::span<const int32_t> far_vertices() const { return std::span(far_).first(num_own_); }
  // The crossing at each corner of all loops.
  const uint8_t* corners() const { return corners_.data(); }
  // First corners of the loops of three and of four corners, and the others.
  std::span<const int16_t> triangles() const { return std::span(triangles_).first(num_triangles_); }
  std::span<const int16_t> quads() const { return std::span(quads_).first(num_quads_); }
  std::span<const Loop> polygons() const { return std::span(polygons_).first(num_polygons_); }
  // Per edge of a cell of this kind: bit set of the edges that share a facet with it.
  const std::array<uint16_t, mesh::kMaxEdges>& facet_mates() const { return *facet_mates_; }

 private:
  static constexpr int kMaxLoops = kMaxClusterCells * mesh::kMaxLoops;
  static constexpr int kMaxCorners = kMaxClusterCells * mesh::kMaxEdges;

  bool FindSigns(std::span<const TimeTerm> terms, float first_later);
  template <int kCorners>
  bool CutCells(const mesh::MarchingTable<kCorners>& table);
  template <int kCorners>
  void AddLoops(const mesh::MarchingTable<kCorners>& table, std::span<const uint8_t> cells);
  template <int kCorners>
  void AddCrossings(const mesh::MarchingTable<kCorners>& table, std::span<const uint8_t> cells);

  // Lists have one place more, for what is written and not kept.
  Cluster cluster_;
  const std::array<std::array<int8_t, 2>, mesh::kMaxEdges>* table_edges_ = nullptr;
  const std::array<uint16_t, mesh::kMaxEdges>* facet_mates_ = nullptr;
  VertexBits is_later_;
  std::array<uint8_t, kMaxClusterCells + kKernelOverrun> codes_;  // per cell: its corners' bits
  int num_crossings_ = 0;
  std::array<Crossing, kMaxClusterEdges + 1> crossings_;
  int num_own_ = 0;
  std::array<uint8_t, kMaxClusterEdges + 1> own_;
  std::array<uint8_t, kMaxClusterEdges + 1> shared_;
  std::array<int32_t, kMaxClusterEdges> near_;
  std::array<int32_t, kMaxClusterEdges> far_;
  std::array<uint8_t, kMaxCorners> corners_;
  int num_triangles_ = 0;
  int num_quads_ = 0;
  int num_polygons_ = 0;
  std::array<int16_t, kMaxLoops + 1> triangles_;
  std::array<int16_t, kMaxLoops + 1> quads_;
  std::array<Loop, kMaxLoops> polygons_;
};

}  // namespace liquidblend::slice

// Cut of one cluster of cells at a time: its crossed edges, and the loops of crossings.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "core/mesh/marching_table.h"
#include "core/slice/cell_index.h"
#include "core/slice/cluster_kernel.h"

namespace liquidblend::slice {

// The crossed edges of a cluster.
struct CrossedEdges {
  EdgeBits edges = {};
  std::array<uint8_t, 4> num_before_word = {};

  // Number of crossed edges before this edge.
  int NumBefore(int edge) const {
    const uint64_t lower = edges[edge / 64] & ((uint64_t{1} << edge % 64) - 1);
    return num_before_word[edge / 64] + std::popcount(lower);
  }
};

// Loop of crossings: a closed polygon.
struct Loop {
  int begin;  // its first corner
  int size;
  const int8_t* cell_edges;  // that its corners lie on
};

// Cutter of one cluster at a time. Keeps its memory from one cluster to the next. Few of its
// branches depend on data: mispredicted ones would take most of the time.  Threads: one at a time.
class CutCluster {
 public:
  // Cuts the cluster. Returns false if no cell is cut.
  //   first_later  the first time that is not before the slice
  bool Cut(const Cluster& cluster, std::span<const TimeTerm> terms, float first_later);

  // The following are of the last cut.
  const Cluster& cluster() const { return cluster_; }
  // The crossed edges, ascending: first the num_own() ones that belong to this cluster.
  std::span<const uint8_t> crossed_edges() const { return std::span(edges_).first(num_crossings_); }
  const CrossedEdges& crossed() const { return crossed_; }
  int num_own() const { return num_own_; }
  // Per crossed edge: its ends, as vertices of the family.
  std::span<const int32_t> near_vertices() const { return std::span(near_).first(num_crossings_); }
  std::span<const int32_t> far_vertices() const { return std::span(far_).first(num_crossings_); }
  // Per corner of all loops: the index of its crossed edge.
  const uint8_t* corners() const { return corners_.data(); }
  // The loops of three, of four and of more corners.
  std::span<const Loop> triangles() const { return LoopsOf(0); }
  std::span<const Loop> quads() const { return LoopsOf(1); }
  std::span<const Loop> polygons() const { return LoopsOf(2); }
  // Per edge of a cell of this kind: bit set of the edges that share a facet with it.
  const std::array<uint16_t, mesh::kMaxEdges>& facet_mates() const { return *facet_mates_; }

 private:
  static constexpr int kMaxLoops = kMaxClusterCells * mesh::kMaxLoops;
  static constexpr int kMaxCorners = kMaxClusterCells * mesh::kMaxEdges;

  std::span<const Loop> LoopsOf(int size_class) const {
    return std::span(loops_[size_class]).first(num_loops_[size_class]);
  }
  void FindSigns(std::span<const TimeTerm> terms, float first_later);
  template <int kCorners>
  bool CutCells(const mesh::MarchingTable<kCorners>& table);
  void ListCrossings();
  template <int kCorners>
  void AddLoops(const mesh::MarchingTable<kCorners>& table, uint64_t cells);

  Cluster cluster_;
  const std::array<uint16_t, mesh::kMaxEdges>* facet_mates_ = nullptr;
  VertexBits is_later_;
  std::array<uint8_t, kMaxClusterCells + kKernelOverrun> codes_;  // per cell: its corners' bits
  CrossedEdges crossed_;
  int num_crossings_ = 0;
  int num_own_ = 0;
  std::array<uint8_t, kMaxClusterEdges> edges_;
  std::array<int32_t, kMaxClusterEdges> near_;
  std::array<int32_t, kMaxClusterEdges> far_;
  // Per edge: the crossing on it, or anything.
  std::array<uint8_t, kMaxClusterEdges + 1> crossing_of_edge_ = {};
  // The last cell may write further than it has corners.
  std::array<uint8_t, kMaxCorners + mesh::kMaxEdges> corners_;
  std::array<int, 3> num_loops_ = {};
  std::array<std::array<Loop, kMaxLoops>, 3> loops_;
};

}  // namespace liquidblend::slice

// Index of a family's cells: small clusters, with bounds of their times for any blend weights.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/registered_family.h"
#include "core/slice/cluster_kernel.h"

namespace liquidblend::slice {

// Limits of a cluster: its numbers fit into a byte each, and its data into the first-level cache.
inline constexpr int kMaxClusterCells = 64;
inline constexpr int kMaxClusterVertices = 128;
inline constexpr int kMaxClusterEdges = 255;
inline constexpr int kClustersPerGroup = 32;

// Kind of a cell.
enum class CellKind : uint8_t { kTetrahedron, kPyramid, kWedge, kHexahedron };

// Cluster: cells of one kind that lie together in space-time. An edge belongs to the first cluster
// that has it; these come first in each cluster's numbering.
struct Cluster {
  CellKind kind = CellKind::kTetrahedron;
  int num_cells = 0;
  int num_edges = 0;                   // of its cells
  int num_own_edges = 0;               // that belong to it
  std::span<const int32_t> vertices;   // of the family, ascending
  const float* times = nullptr;        // per field of times and vertex
  int num_first_vertices = 0;          // of the slab before the first frame: the first ones
  int num_last_vertices = 0;           // of the slab after the last frame: the last ones
  const uint8_t* corners = nullptr;    // per corner and cell: one of `vertices`
  const uint8_t* edges = nullptr;      // per cell and edge, as the marching table numbers them
  const uint8_t* low_ends = nullptr;   // per edge: the lower one of the vertices that it joins ...
  const uint8_t* high_ends = nullptr;  // ... and the higher one
  bool has_repeated_corners = false;   // some cell has one of its vertices twice
  // Per edge from num_own_edges on: the cluster it belongs to, and its number there.
  const int32_t* owner_clusters = nullptr;
  const uint8_t* owner_edges = nullptr;
};

// Smallest and largest value of one field over the vertices of each cluster, or of a group of them;
// ticks. In the source, a cluster with a vertex of an end slab, whose time is clamped when
// blending, reaches to infinity on that side.
struct TimeRanges {
  std::vector<float> min, max;
};

// Index of a family's cells: their clusters, and ranges of times of clusters and groups of them.
// Threads: safe, immutable.
class CellIndex {
 public:
  // Builds the index.  Requires: family passed Validate(); it must outlive the index. Cost: O(cells
  // log cells), about 0.7 us per cell (lb_bench, BuildCellIndex).
  explicit CellIndex(const mesh::RegisteredFamily& family);
  CellIndex(const CellIndex&) = delete;
  CellIndex& operator=(const CellIndex&) = delete;

  const mesh::RegisteredFamily& family() const { return *family_; }
  int32_t num_clusters() const { return static_cast<int32_t>(records_.size()); }
  // Clusters of one kind of cells follow one another.
  Cluster cluster(int32_t number) const;
  // Prefetch a cluster that will be used soon, in two steps: first its record, then its data.
  void PrefetchRecord(int32_t number) const { __builtin_prefetch(&records_[number]); }
  void Prefetch(int32_t number) const;
  // Ranges per field of times: the source's, then each target's displacement and, if it has its
  // own, extrapolation.
  std::span<const TimeRanges> cluster_times() const { return cluster_times_; }
  // Group g has the clusters [kClustersPerGroup g, kClustersPerGroup (g + 1)).
  std::span<const TimeRanges> group_times() const { return group_times_; }
  // Terms that are added to the source's times at these weights. Requires: one weight per target.
  void AppendTerms(std::span<const double> weights, std::vector<TimeTerm>& terms) const;
  int64_t size_bytes() const;  // memory of the index, without the family

 private:
  friend class ClusterBuilder;
  // Begin and counts of a cluster's numbers.
  struct Record {
    int64_t first_byte = 0;
    int64_t first_vertex = 0;
    int64_t first_owner = 0;
    CellKind kind = CellKind::kTetrahedron;
    uint8_t num_cells = 0;
    uint8_t num_vertices = 0;
    uint8_t num_edges = 0;
    uint8_t num_own_edges = 0;
    uint8_t num_first_vertices = 0;
    uint8_t num_last_vertices = 0;
    bool has_repeated_corners = false;
  };

  void CopyTimes();

  const mesh::RegisteredFamily* family_;
  std::vector<Record> records_;
  std::vector<uint8_t> bytes_;  // per cluster: corners, edges, ends; then kKernelOverrun more
  std::vector<int32_t> vertices_;
  std::vector<float> times_;  // per cluster: of its vertices, field by field
  std::vector<int32_t> owner_clusters_;
  std::vector<uint8_t> owner_edges_;
  std::vector<TimeRanges> cluster_times_;
  std::vector<TimeRanges> group_times_;
};

}  // namespace liquidblend::slice

// Where in time a family's cells can be, for any blend weights.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/registered_family.h"

namespace liquidblend::slice {

inline constexpr int kCellsPerCluster = 128;
inline constexpr int kVerticesPerBlock = 256;

// One kind's cells in the order of their lowest vertices: the family's own array if that is sorted
// already, else a sorted copy.
template <typename Cell>
struct SortedCells {
  std::vector<Cell> copy;
  std::span<const Cell> cells;
  int32_t first_cluster = 0;  // cluster first_cluster + k has cells [128 k, 128 (k + 1))
};

// Smallest and largest value per cluster, over the vertices of its cells; frames.
struct TimeRanges {
  std::vector<float> min, max;
};

struct TargetTimeRanges {
  TimeRanges displacement;
  TimeRanges extrapolation;  // empty if the target has none of its own
};

// Clusters of 128 cells of one kind, each with conservative bounds of its time and with the blocks
// of 256 vertices that it needs.
// Threads: safe, immutable.
class CellIndex {
 public:
  // Requires: family passed Validate(); it must outlive the index.
  // Cost: O(cells log cells), O(cells) if they are sorted by their lowest vertices.
  explicit CellIndex(const mesh::RegisteredFamily& family);
  CellIndex(const CellIndex&) = delete;
  CellIndex& operator=(const CellIndex&) = delete;

  const mesh::RegisteredFamily& family() const { return *family_; }
  int32_t num_clusters() const { return static_cast<int32_t>(source_time_.min.size()); }
  int32_t num_blocks() const;  // vertex blocks, of which the last may be short
  int64_t size_bytes() const;  // memory of the index, without the family

  const SortedCells<mesh::Tetrahedron>& tetrahedra() const { return tetrahedra_; }
  const SortedCells<mesh::Pyramid>& pyramids() const { return pyramids_; }
  const SortedCells<mesh::Wedge>& wedges() const { return wedges_; }
  const SortedCells<mesh::Hexahedron>& hexahedra() const { return hexahedra_; }

  // Times of the source's vertices. A cluster with a vertex of an end slab, whose time is clamped
  // when blending, reaches to infinity on that side.
  const TimeRanges& source_time() const { return source_time_; }
  const TargetTimeRanges& target_time(int target) const { return target_time_[target]; }
  // Vertex blocks of a cluster, ascending.
  std::span<const int32_t> blocks(int32_t cluster) const {
    return std::span(blocks_).subspan(first_block_[cluster],
                                      first_block_[cluster + 1] - first_block_[cluster]);
  }

 private:
  template <typename Cell>
  void AddKind(std::span<const Cell> cells, SortedCells<Cell>& sorted);
  void AddCluster(std::span<const int32_t> corners, std::vector<int32_t>& scratch);

  const mesh::RegisteredFamily* family_;
  SortedCells<mesh::Tetrahedron> tetrahedra_;
  SortedCells<mesh::Pyramid> pyramids_;
  SortedCells<mesh::Wedge> wedges_;
  SortedCells<mesh::Hexahedron> hexahedra_;
  TimeRanges source_time_;
  std::vector<TargetTimeRanges> target_time_;
  std::vector<int32_t> first_block_ = {0};  // per cluster, and the end
  std::vector<int32_t> blocks_;
};

}  // namespace liquidblend::slice

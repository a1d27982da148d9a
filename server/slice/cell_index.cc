#include "server/slice/cell_index.h"

#include <algorithm>
#include <limits>

namespace liquidblend::slice {
namespace {

template <typename Cell>
bool IsBefore(const Cell& a, const Cell& b) {
  return *std::min_element(a.begin(), a.end()) < *std::min_element(b.begin(), b.end());
}

void AddRange(std::span<const mesh::Float4> values, std::span<const int32_t> vertices,
              TimeRanges& ranges) {
  float min = std::numeric_limits<float>::infinity();
  float max = -min;
  for (const int32_t v : vertices) {
    min = std::min(min, values[v][3]);
    max = std::max(max, values[v][3]);
  }
  ranges.min.push_back(min);
  ranges.max.push_back(max);
}

int64_t SizeBytes(const TimeRanges& ranges) {
  return static_cast<int64_t>((ranges.min.capacity() + ranges.max.capacity()) * sizeof(float));
}

}  // namespace

CellIndex::CellIndex(const mesh::RegisteredFamily& family) : family_(&family) {
  target_time_.resize(family.targets.size());
  AddKind(family.tetrahedra, tetrahedra_);
  AddKind(family.pyramids, pyramids_);
  AddKind(family.wedges, wedges_);
  AddKind(family.hexahedra, hexahedra_);
}

template <typename Cell>
void CellIndex::AddKind(std::span<const Cell> cells, SortedCells<Cell>& sorted) {
  sorted.cells = cells;
  sorted.first_cluster = num_clusters();
  if (!std::is_sorted(cells.begin(), cells.end(), IsBefore<Cell>)) {
    sorted.copy.assign(cells.begin(), cells.end());
    std::stable_sort(sorted.copy.begin(), sorted.copy.end(), IsBefore<Cell>);
    sorted.cells = sorted.copy;
  }
  std::vector<int32_t> scratch;
  for (size_t begin = 0; begin < cells.size(); begin += kCellsPerCluster) {
    const size_t count = std::min<size_t>(kCellsPerCluster, cells.size() - begin);
    const Cell* first = &sorted.cells[begin];
    AddCluster({first->data(), count * first->size()}, scratch);
  }
}

void CellIndex::AddCluster(std::span<const int32_t> corners, std::vector<int32_t>& scratch) {
  AddRange(family_->vertices, corners, source_time_);
  for (size_t k = 0; k < target_time_.size(); ++k) {
    const mesh::FamilyTarget& target = family_->targets[k];
    AddRange(target.displacement, corners, target_time_[k].displacement);
    if (!target.extrapolation.empty()) {
      AddRange(target.extrapolation, corners, target_time_[k].extrapolation);
    }
  }
  const auto [lowest, highest] = std::minmax_element(corners.begin(), corners.end());
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto num_vertices = static_cast<int64_t>(family_->vertices.size());
  if (*lowest < family_->num_first_vertices) source_time_.min.back() = -kInfinity;
  if (*highest >= num_vertices - family_->num_last_vertices) source_time_.max.back() = kInfinity;

  scratch.clear();
  for (const int32_t v : corners) scratch.push_back(v / kVerticesPerBlock);
  std::sort(scratch.begin(), scratch.end());
  blocks_.insert(blocks_.end(), scratch.begin(), std::unique(scratch.begin(), scratch.end()));
  first_block_.push_back(static_cast<int32_t>(blocks_.size()));
}

int32_t CellIndex::num_blocks() const {
  const auto num_vertices = static_cast<int64_t>(family_->vertices.size());
  return static_cast<int32_t>((num_vertices + kVerticesPerBlock - 1) / kVerticesPerBlock);
}

int64_t CellIndex::size_bytes() const {
  int64_t bytes = SizeBytes(source_time_);
  for (const TargetTimeRanges& target : target_time_) {
    bytes += SizeBytes(target.displacement) + SizeBytes(target.extrapolation);
  }
  const auto of = [](const auto& array) {
    return static_cast<int64_t>(array.capacity() * sizeof(array[0]));
  };
  return bytes + of(tetrahedra_.copy) + of(pyramids_.copy) + of(wedges_.copy) +
         of(hexahedra_.copy) + of(first_block_) + of(blocks_);
}

}  // namespace liquidblend::slice

#include "core/slice/cell_order.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace liquidblend::slice {
namespace {

constexpr int kBits = 10;  // of the grid, along each axis
// Frame intervals in a slab of time. With one, clusters are flat: fewer cells are tested in vain
// where time is not warped, but more edges lie between clusters. Two were as fast or faster, and
// smaller.
constexpr uint64_t kFramesPerSlab = 2;
constexpr double kRounding = 1e-3;  // frames: of ticks
constexpr uint32_t kMostCoordinate = (1U << kBits) - 1;

// Maps the family's source to the grid.
class Grid {
 public:
  explicit Grid(const mesh::RegisteredFamily& family) {
    mesh::Float3 high = {};
    min_.fill(std::numeric_limits<float>::infinity());
    high.fill(-std::numeric_limits<float>::infinity());
    for (const mesh::Float4& v : family.vertices) {
      for (int k = 0; k < 3; ++k) {
        min_[k] = std::min(min_[k], v[k]);
        high[k] = std::max(high[k], v[k]);
      }
    }
    float extent = 0.0F;
    for (int k = 0; k < 3; ++k) extent = std::max(extent, high[k] - min_[k]);
    if (extent > 0.0F && std::isfinite(extent)) scale_ = kMostCoordinate / extent;
  }

  std::array<uint32_t, 3> PointOf(const mesh::Float3& at) const {
    std::array<uint32_t, 3> point;
    for (int k = 0; k < 3; ++k) {
      const float place = scale_ * (at[k] - min_[k]);
      point[k] =
          static_cast<uint32_t>(std::clamp(place, 0.0F, static_cast<float>(kMostCoordinate)));
    }
    return point;
  }

 private:
  mesh::Float3 min_;
  float scale_ = 0.0F;
};

}  // namespace

// J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707 (2004).
uint32_t HilbertPlace(std::array<uint32_t, 3> point) {
  for (uint32_t bit = 1U << (kBits - 1); bit > 1; bit >>= 1) {
    const uint32_t lower = bit - 1;
    for (int k = 0; k < 3; ++k) {
      if ((point[k] & bit) != 0) {
        point[0] ^= lower;
      } else {
        const uint32_t swapped = (point[0] ^ point[k]) & lower;
        point[0] ^= swapped;
        point[k] ^= swapped;
      }
    }
  }
  point[1] ^= point[0];
  point[2] ^= point[1];
  uint32_t flips = 0;
  for (uint32_t bit = 1U << (kBits - 1); bit > 1; bit >>= 1) {
    if ((point[2] & bit) != 0) flips ^= bit - 1;
  }
  for (uint32_t& coordinate : point) coordinate ^= flips;
  uint32_t place = 0;
  for (int b = kBits - 1; b >= 0; --b) {
    for (const uint32_t coordinate : point) place = place << 1 | (coordinate >> b & 1);
  }
  return place;
}

template <typename Cell>
std::vector<OrderedCell> OrderCells(const mesh::RegisteredFamily& family,
                                    std::span<const Cell> cells) {
  const Grid grid(family);
  const mesh::TimeAxis axis = family.time_axis();
  std::vector<OrderedCell> ordered(cells.size());
  for (size_t c = 0; c < cells.size(); ++c) {
    mesh::Float3 centre = {};
    float earliest = std::numeric_limits<float>::infinity();
    for (const int32_t corner : cells[c]) {
      const mesh::Float4& v = family.vertices[corner];
      for (int k = 0; k < 3; ++k) centre[k] += v[k] / static_cast<float>(cells[c].size());
      earliest = std::min(earliest, v[3]);
    }
    // The frame in which the cell begins, plus 1, so that cells before the first frame have 0.
    const double frame = std::clamp(std::floor(axis.Frames(earliest) + kRounding), -1.0,
                                    static_cast<double>(family.num_frames)) +
                         1.0;
    const uint64_t slab = static_cast<uint64_t>(frame) / kFramesPerSlab;
    ordered[c].key = slab << (3 * kBits) | HilbertPlace(grid.PointOf(centre));
    ordered[c].cell = static_cast<int32_t>(c);
  }
  std::sort(ordered.begin(), ordered.end(), [](const OrderedCell& a, const OrderedCell& b) {
    return std::tie(a.key, a.cell) < std::tie(b.key, b.cell);
  });
  return ordered;
}

template std::vector<OrderedCell> OrderCells(const mesh::RegisteredFamily&,
                                             std::span<const mesh::Tetrahedron>);
template std::vector<OrderedCell> OrderCells(const mesh::RegisteredFamily&,
                                             std::span<const mesh::Pyramid>);
template std::vector<OrderedCell> OrderCells(const mesh::RegisteredFamily&,
                                             std::span<const mesh::Wedge>);
template std::vector<OrderedCell> OrderCells(const mesh::RegisteredFamily&,
                                             std::span<const mesh::Hexahedron>);

}  // namespace liquidblend::slice

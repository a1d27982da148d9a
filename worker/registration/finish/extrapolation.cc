#include "worker/registration/finish/extrapolation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/numeric/int128.h"
#include "worker/registration/finish/finish.h"

namespace liquidblend::registration {
namespace {

constexpr int kSweeps = 5;            // of the averaging along the surface, against noise
constexpr float kGridSpacing = 3.0f;  // edges and frames

using GridPoint = std::array<int32_t, 4>;

// Compared faster than the four numbers.
absl::uint128 KeyOf(const GridPoint& point) {
  const auto pair = [&](int k) {
    return static_cast<uint64_t>(static_cast<uint32_t>(point[k])) << 32 |
           static_cast<uint32_t>(point[k + 1]);
  };
  return absl::MakeUint128(pair(0), pair(2));
}

// A point's place in the grid: the lowest corner of its cell, and where in the cell it is.
struct GridPlace {
  GridPoint corner;
  Eigen::Vector4f offset;  // in [0, 1)

  explicit GridPlace(const Eigen::Vector4f& point) {
    constexpr float kFarthest = 1e8f;  // cells; what is further shares the last one
    const Eigen::Vector4f scaled = (point / kGridSpacing).cwiseMax(-kFarthest).cwiseMin(kFarthest);
    for (int k = 0; k < 4; ++k) {
      const float low = std::floor(scaled[k]);
      corner[k] = static_cast<int32_t>(low);
      offset[k] = scaled[k] - low;
    }
  }
  // One of the 16 points around: bit k of c says whether it is the upper one along axis k.
  GridPoint Point(int c) const {
    GridPoint point = corner;
    for (int k = 0; k < 4; ++k) point[k] += c >> k & 1;
    return point;
  }
  float Weight(int c) const {
    float weight = 1;
    for (int k = 0; k < 4; ++k) weight *= (c >> k & 1) != 0 ? offset[k] : 1 - offset[k];
    return weight;
  }
};

// The grid's points around the place that was asked for last: the next one is mostly in the same
// cell.
struct LastCell {
  GridPoint corner = {};
  std::array<size_t, 16> points = {};
  bool is_known = false;
};

// Sums of values and of weights at the points of a grid that have some.
class SparseGrid {
 public:
  using Sum = Eigen::Matrix<double, 5, 1>;  // values, weight

  void Add(const GridPlace& place, const Eigen::Vector4f& value, LastCell& cell) {
    Sum sum;
    sum << value.cast<double>(), 1.0;
    FindPoints(place, cell, [this](const GridPoint& point) { return FindOrAdd(point); });
    for (int c = 0; c < 16; ++c) sums_[cell.points[c]] += place.Weight(c) * sum;
  }
  void Add(const SparseGrid& other) {
    for (size_t n = 0; n < other.sums_.size(); ++n) {
      sums_[FindOrAdd(other.points_[n])] += other.sums_[n];
    }
  }
  // Half of each point's sums go to its neighbours along each axis in turn.
  void Blur(const parallel::Arena& arena) {
    std::vector<Sum> next(sums_.size());
    for (int axis = 0; axis < 4; ++axis) {
      arena.For(static_cast<int64_t>(sums_.size()), [&](int64_t n) {
        next[n] = 0.5 * sums_[n];
        for (const int step : {-1, 1}) {
          GridPoint point = points_[n];
          point[axis] += step;
          const auto found = index_.find(KeyOf(point));
          if (found != index_.end()) next[n] += 0.25 * sums_[found->second];
        }
      });
      sums_.swap(next);
    }
  }
  Eigen::Vector4f Mean(const GridPlace& place, LastCell& cell) const {
    Sum sum = Sum::Zero();
    FindPoints(place, cell, [this](const GridPoint& point) { return index_.at(KeyOf(point)); });
    for (int c = 0; c < 16; ++c) sum += place.Weight(c) * sums_[cell.points[c]];
    return (sum.head<4>() / sum[4]).cast<float>();
  }

 private:
  template <typename Find>
  static void FindPoints(const GridPlace& place, LastCell& cell, const Find& find) {
    if (cell.is_known && cell.corner == place.corner) return;
    cell = {.corner = place.corner, .points = {}, .is_known = true};
    for (int c = 0; c < 16; ++c) cell.points[c] = find(place.Point(c));
  }
  size_t FindOrAdd(const GridPoint& point) {
    const auto [found, is_new] = index_.try_emplace(KeyOf(point), sums_.size());
    if (is_new) {
      sums_.push_back(Sum::Zero());
      points_.push_back(point);
    }
    return found->second;
  }

  absl::flat_hash_map<absl::uint128, size_t> index_;  // by KeyOf(); never walked through
  std::vector<GridPoint> points_;
  std::vector<Sum> sums_;
};

// Sums of the values at the points: of kChunk of them each for itself, then of these in their
// order.
void AddAll(const Points& points, const Points& values, const parallel::Arena& arena,
            SparseGrid& grid) {
  constexpr int64_t kChunk = 1 << 16;
  constexpr int64_t kBatch = 16;  // chunks whose grids are in memory at a time
  const int64_t num_chunks = (points.cols() + kChunk - 1) / kChunk;
  for (int64_t first = 0; first < num_chunks; first += kBatch) {
    std::vector<SparseGrid> of_chunk(std::min(kBatch, num_chunks - first));
    arena.Run(static_cast<int64_t>(of_chunk.size()), [&](int64_t n) {
      LastCell cell;
      const int64_t begin = (first + n) * kChunk, end = std::min(begin + kChunk, points.cols());
      for (int64_t v = begin; v < end; ++v) {
        of_chunk[n].Add(GridPlace(points.col(v)), values.col(v), cell);
      }
    });
    for (const SparseGrid& some : of_chunk) grid.Add(some);
  }
}

}  // namespace

Points Extrapolation(const Surface& source, const PackedLists& neighbors,
                     const Points& displacement, const parallel::Arena& arena) {
  const Points smooth = Smooth(displacement, neighbors, kSweeps, arena);
  const Points deformed = source.points + displacement;
  SparseGrid grid;
  AddAll(deformed, smooth, arena, grid);
  grid.Blur(arena);
  Points mean(4, deformed.cols());
  arena.ForChunks(mean.cols(), 512, [&](int64_t, int64_t begin, int64_t end) {
    LastCell last;
    for (int64_t v = begin; v < end; ++v) {
      mean.col(v) = grid.Mean(GridPlace(deformed.col(v)), last);
    }
  });
  return mean;
}

}  // namespace liquidblend::registration

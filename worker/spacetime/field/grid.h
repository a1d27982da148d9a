// The regular grid that space-time surface nets are the dual of. Internal to worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace liquidblend::spacetime {

inline constexpr int kTimeAxis = 3;

// Grid point (i, j, k) lies at origin_m + spacing_m * (i, j, k); there are dims points per axis.
// "Grid units" below: positions with the origin at grid point 0 and the spacing as unit.
struct Grid {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  double spacing_m = 1.0;
  std::array<int, 3> dims = {0, 0, 0};

  int64_t num_rows() const { return static_cast<int64_t>(dims[1]) * dims[2]; }
  int64_t Row(int j, int k) const { return static_cast<int64_t>(k) * dims[1] + j; }
  int words_per_row() const { return (dims[0] + 63) / 64; }
};

// A triangle surface in grid units, from which one layer of the grid is sampled.
struct GridSurface {
  Eigen::Matrix3Xf vertices;
  Eigen::Matrix3Xi triangles;
  Eigen::Matrix3Xf velocities;  // metres per second, or no columns
};

// One bit per grid point. Rows along x, padded to whole words.
class PointBits {
 public:
  PointBits() = default;
  explicit PointBits(const Grid& grid)
      : words_per_row_(grid.words_per_row()),
        num_y_(grid.dims[1]),
        words_(grid.num_rows() * grid.words_per_row(), 0) {}

  bool At(int i, int j, int k) const { return (Row(j, k)[i >> 6] >> (i & 63)) & 1u; }
  // The bits of the corners of voxel (i, j, k), numbered by their bits x, y, z.
  uint8_t AtCorners(int i, int j, int k) const {
    const int word = i >> 6, bit = i & 63;
    unsigned corners = 0;
    for (int r = 0; r < 4; ++r) {
      const uint64_t* row = Row(j + (r & 1), k + (r >> 1)) + word;
      const uint64_t pair = bit < 63 ? row[0] >> bit : row[0] >> 63 | row[1] << 1;
      corners |= static_cast<unsigned>(pair & 3) << (2 * r);
    }
    return static_cast<uint8_t>(corners);
  }
  // The bits of 64 points along x from (i, j, k) on; 0 beyond the row.
  uint64_t From(int i, int j, int k) const {
    const int word = i >> 6, bit = i & 63;
    const uint64_t* row = Row(j, k);
    const uint64_t low = row[word] >> bit;
    return bit == 0 || word + 1 == words_per_row_ ? low : low | row[word + 1] << (64 - bit);
  }
  const uint64_t* Row(int j, int k) const {
    return words_.data() + (static_cast<int64_t>(k) * num_y_ + j) * words_per_row_;
  }
  uint64_t* MutableRow(int64_t row) { return words_.data() + row * words_per_row_; }
  void Set(const Grid& grid, int i, int j, int k) {
    MutableRow(grid.Row(j, k))[i >> 6] |= uint64_t{1} << (i & 63);
  }
  // All rows, one after another.
  std::vector<uint64_t>& words() { return words_; }
  const std::vector<uint64_t>& words() const { return words_; }

 private:
  int words_per_row_ = 0;
  int num_y_ = 0;
  std::vector<uint64_t> words_;
};

// The points inside the liquid.
using InsideBits = PointBits;

// Calls visit(bit) for each set bit of a row of words, lowest first.
template <typename Visit>
void ForEachBit(const uint64_t* words, int num_words, Visit&& visit) {
  for (int w = 0; w < num_words; ++w) {
    for (uint64_t rest = words[w]; rest != 0; rest &= rest - 1) {
      visit(w * 64 + std::countr_zero(rest));
    }
  }
}

}  // namespace liquidblend::spacetime

#include "worker/spacetime/nets/mixed_cells.h"

#include <algorithm>

namespace liquidblend::spacetime {

MixedCells::MixedCells(const Grid& grid, std::span<const InsideBits* const> layers)
    : layers_(layers),
      any_(grid.words_per_row() + 1),
      all_(grid.words_per_row() + 1),
      mixed_(grid.words_per_row()) {}

const std::vector<uint64_t>& MixedCells::Row(int j, int k) {
  const size_t num_words = mixed_.size();
  std::fill(any_.begin(), any_.end(), uint64_t{0});
  std::fill(all_.begin(), all_.end(), ~uint64_t{0});
  for (const InsideBits* layer : layers_) {
    for (int r = 0; r < 4; ++r) {
      const uint64_t* row = layer->Row(j + (r & 1), k + (r >> 1));
      for (size_t w = 0; w < num_words; ++w) {
        any_[w] |= row[w];
        all_[w] &= row[w];
      }
    }
  }
  all_[num_words] = 0;
  for (size_t w = 0; w < num_words; ++w) {
    const uint64_t any_next = any_[w] >> 1 | any_[w + 1] << 63;
    const uint64_t all_next = all_[w] >> 1 | all_[w + 1] << 63;
    mixed_[w] = (any_[w] | any_next) & ~(all_[w] & all_next);
  }
  return mixed_;
}

PointBits CornersOfMixedCells(const Grid& grid, std::span<const InsideBits* const> layers) {
  PointBits corners(grid);
  MixedCells cells(grid, layers);
  for (int k = 0; k + 1 < grid.dims[2]; ++k) {
    for (int j = 0; j + 1 < grid.dims[1]; ++j) {
      const std::vector<uint64_t>& mixed = cells.Row(j, k);
      for (int r = 0; r < 4; ++r) {
        uint64_t* row = corners.MutableRow(grid.Row(j + (r & 1), k + (r >> 1)));
        uint64_t carry = 0;
        for (size_t w = 0; w < mixed.size(); ++w) {
          row[w] |= mixed[w] | mixed[w] << 1 | carry;
          carry = mixed[w] >> 63;
        }
      }
    }
  }
  return corners;
}

}  // namespace liquidblend::spacetime

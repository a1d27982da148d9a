#include "worker/spacetime/nets/slab_steps.h"

#include <algorithm>

namespace liquidblend::spacetime {

SlabSteps::SlabSteps(const Grid& grid, int num_steps) : num_steps_(num_steps) {
  if (num_steps == 1) return;
  for (int axis = 0; axis < 3; ++axis) block_dims_[axis] = (grid.dims[axis] + kBlock - 1) / kBlock;
  of_block_.assign(static_cast<int64_t>(block_dims_[0]) * block_dims_[1] * block_dims_[2], 1);
}

template <typename Visit>
void SlabSteps::ForEachBlock(Voxel lo, Voxel hi, Visit&& visit) const {
  for (int axis = 0; axis < 3; ++axis) {
    lo[axis] = std::max(0, lo[axis]) / kBlock;
    hi[axis] = hi[axis] < 0 ? -1 : std::min(block_dims_[axis] - 1, hi[axis] / kBlock);
  }
  for (int k = lo[2]; k <= hi[2]; ++k) {
    for (int j = lo[1]; j <= hi[1]; ++j) {
      for (int i = lo[0]; i <= hi[0]; ++i) {
        visit((static_cast<int64_t>(k) * block_dims_[1] + j) * block_dims_[0] + i);
      }
    }
  }
}

void SlabSteps::Refine(const Voxel& lo, const Voxel& hi, int steps) {
  if (num_steps_ == 1) return;
  ForEachBlock(lo, hi, [&](int64_t block) {
    of_block_[block] = std::max(of_block_[block], static_cast<uint8_t>(steps));
  });
}

SlabSteps SlabSteps::Grown() const {
  SlabSteps grown = *this;
  for (size_t block = 0; block < grown.of_block_.size(); ++block) {
    Voxel at;
    auto rest = static_cast<int>(block);
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = rest % block_dims_[axis] * kBlock;
      rest /= block_dims_[axis];
    }
    const Voxel lo = {at[0] - kBlock, at[1] - kBlock, at[2] - kBlock};
    const Voxel hi = {at[0] + kBlock, at[1] + kBlock, at[2] + kBlock};
    grown.of_block_[block] = static_cast<uint8_t>(Most(lo, hi));
  }
  return grown;
}

PointBits SlabSteps::CutPoints(const Grid& grid) const {
  PointBits points(grid);
  if (num_steps_ == 1) return points;
  constexpr uint64_t kBits = (uint64_t{1} << kBlock) - 1;
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      uint64_t* row = points.MutableRow(grid.Row(j, k));
      for (int i = 0; i < grid.dims[0]; i += kBlock) {
        if (OfVoxel(i, j, k) > 1) row[i >> 6] |= kBits << (i & 63);
      }
      const int rest = grid.dims[0] & 63;
      if (rest != 0) row[grid.words_per_row() - 1] &= (uint64_t{1} << rest) - 1;
    }
  }
  return points;
}

int SlabSteps::Most(Voxel lo, Voxel hi) const {
  if (num_steps_ == 1) return 1;
  int most = 1;
  ForEachBlock(lo, hi, [&](int64_t block) { most = std::max<int>(most, of_block_[block]); });
  return most;
}

}  // namespace liquidblend::spacetime

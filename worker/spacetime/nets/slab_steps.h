// Steps of a slab: how finely each of its blocks is cut in time. Internal to worker/spacetime.
//
// A slab lies between the layers of two frames. Where the surface moves far, the slab is cut into
// steps by layers in between; elsewhere one cell spans several steps, or the whole slab.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "worker/spacetime/field/grid.h"

namespace liquidblend::spacetime {

// The layers of a slab from `begin` on, a bit each.
using LayerMask = uint16_t;

// The number of steps of each block of kBlock^3 voxels: a power of two that divides that of the
// slab.
class SlabSteps {
 public:
  static constexpr int kBlock = 4;
  static constexpr int kMaxSteps = 8;
  using Voxel = std::array<int, 3>;

  SlabSteps() = default;  // one step everywhere
  // One step everywhere; Refine() allows up to num_steps.
  SlabSteps(const Grid& grid, int num_steps);

  int num_steps() const { return num_steps_; }
  // Sets at least `steps` in the blocks that touch voxels lo to hi.
  void Refine(const Voxel& lo, const Voxel& hi, int steps);
  // A copy with each block cut as finely as the finest of its neighbours.
  SlabSteps Grown() const;
  // The largest number of steps of the blocks that touch voxels lo to hi, without those outside of
  // the grid.
  int Most(Voxel lo, Voxel hi) const;

  // The points of the blocks that are cut.
  PointBits CutPoints(const Grid& grid) const;

  int OfVoxel(int i, int j, int k) const {
    return num_steps_ == 1 ? 1 : of_block_[BlockOf({i, j, k})];
  }
  // The largest number of steps of the voxels around the grid edge along `axis` (0 to 2) from point
  // (i, j, k) up.
  int OfEdge(int axis, int i, int j, int k) const {
    Voxel lo = {i - 1, j - 1, k - 1};
    lo[axis] += 1;
    return Most(lo, {i, j, k});
  }
  int OfPoint(int i, int j, int k) const { return Most({i - 1, j - 1, k - 1}, {i, j, k}); }
  // Whether a neighbour of the voxel is cut more finely.
  bool IsBesideFiner(int i, int j, int k) const {
    return num_steps_ > 1 && Most({i - 1, j - 1, k - 1}, {i + 1, j + 1, k + 1}) > OfVoxel(i, j, k);
  }

  // The layers of [begin, begin + span] at which blocks of `steps` steps are cut.
  LayerMask LayersOf(int steps, int begin, int span) const {
    const int apart = num_steps_ / steps;
    LayerMask mask = 0;
    for (int l = 0; l <= span; ++l) {
      if ((begin + l) % apart == 0) mask = static_cast<LayerMask>(mask | 1u << l);
    }
    return mask;
  }

 private:
  int64_t BlockOf(const Voxel& voxel) const {
    return (static_cast<int64_t>(voxel[2] / kBlock) * block_dims_[1] + voxel[1] / kBlock) *
               block_dims_[0] +
           voxel[0] / kBlock;
  }
  template <typename Visit>
  void ForEachBlock(Voxel lo, Voxel hi, Visit&& visit) const;

  int num_steps_ = 1;
  std::array<int, 3> block_dims_ = {0, 0, 0};
  std::vector<uint8_t> of_block_;
};

}  // namespace liquidblend::spacetime

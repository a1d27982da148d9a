// Times of the grid's layers, and the blocks where layers between two frames are needed. Internal
// to worker/spacetime.
#pragma once

#include <vector>

#include "core/mesh/animation.h"
#include "worker/spacetime/nets/slab_steps.h"

namespace liquidblend::spacetime {

// One layer: frame `earlier` moved on by its velocities, blended with frame `later` moved back.
struct LayerTime {
  double time;   // frames since the first
  int earlier;   // index of a frame
  int later;     // the next one; or the same: no blend
  double share;  // [0, 1); of the later frame
};

struct LayerPlan {
  std::vector<LayerTime> layers;
  std::vector<int> first_layer;  // per slab, and the last layer: slab s has the layers
                                 // [first_layer[s], first_layer[s + 1]]
  int num_slabs() const { return static_cast<int>(first_layer.size()) - 1; }
  int num_steps(int slab) const { return first_layer[slab + 1] - first_layer[slab]; }
};

// One layer a frame and one before and after all; 1, 3 or 7 more between two frames where the
// surface moves by more than max_motion_m from one to the other, so that thin parts stay in one
// piece. Without velocities frames cannot be moved, so there are no layers in between.
// Requires: at least one frame, max_motion_m > 0.
LayerPlan PlanLayers(const mesh::Animation& animation, double max_motion_m);

// Cuts the blocks that the surface sweeps between two frames, as finely as the fastest part of the
// surface there requires.
SlabSteps PlanSteps(const mesh::Animation& animation, const LayerPlan& plan, int slab,
                    const Grid& grid, double max_motion_m);

// The vertices of a frame moved by its velocities for `frames`; as they are without velocities, and
// in a pre-roll.
Eigen::Matrix3Xf Advected(const mesh::Animation& animation, int frame, double frames);

}  // namespace liquidblend::spacetime

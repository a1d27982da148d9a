// When the layers of the grid are. Internal to worker/spacetime.
#pragma once

#include <vector>

#include "core/mesh/animation.h"

namespace liquidblend::spacetime {

// One layer: frame `earlier` moved on by its velocities, blended with frame `later` moved back.
struct LayerTime {
  double time;   // frames since the first
  int earlier;   // index of a frame
  int later;     // the next one; or the same: no blend
  double share;  // [0, 1); of the later frame
};

// One layer a frame and one before and after all; more between two frames where the surface moves
// by more than max_motion_m from one to the other, so that what is thin stays in one piece.
// Without velocities there is nothing to move frames by, hence no layers in between.
// Requires: at least one frame, max_motion_m > 0.
std::vector<LayerTime> PlanLayers(const mesh::Animation& animation, double max_motion_m);

// The vertices of a frame moved by its velocities for `frames`; as they are without velocities.
Eigen::Matrix3Xf Advected(const mesh::Animation& animation, int frame, double frames);

}  // namespace liquidblend::spacetime

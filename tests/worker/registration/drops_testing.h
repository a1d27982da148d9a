// Drops that fall steadily into a pool.
#pragma once

#include <vector>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {

constexpr double kDropRadius = 0.25;

inline synthetic::SteadyDrop DropAt(double x, double z, double released_frame = 0) {
  return {{x, 0, z}, kDropRadius, released_frame};
}

// A column connects it with the pool.
inline synthetic::SteadyDrop BridgedDropAt(double x, double z) {
  synthetic::SteadyDrop drop = DropAt(x, z);
  drop.bridge_radius_m = 0.13;
  return drop;
}

inline mesh::SpaceTimeMesh Scene(const std::vector<synthetic::SteadyDrop>& drops,
                                 double half_width_m = 1.2, int num_frames = 12) {
  synthetic::FallingDropsOptions options;
  options.drops = drops;
  options.pool_half_width_m = {half_width_m, 0.5};
  options.num_frames = num_frames;
  return BuildMesh(synthetic::FallingDrops(options));
}

}  // namespace liquidblend::registration

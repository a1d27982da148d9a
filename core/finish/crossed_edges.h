// Edges of a family that a slice's vertices lie on.
#pragma once

#include <cstdint>
#include <span>

#include "core/mesh/registered_family.h"

namespace liquidblend::finish {

// The edges that a slice's vertices lie on: vertex i is on the edge between two vertices of the
// family.
struct CrossedEdges {
  std::span<const int32_t> low, high;  // per vertex of the slice
  // Positions of the ends in the blend, without smoothing in time, which would disturb the
  // velocities. Metres and ticks.
  std::span<const mesh::Float4> low_positions, high_positions;
  double time_ticks = 0.0;  // of the slice
};

}  // namespace liquidblend::finish

// How far a blend weight moves a family's vertices: the one rule that whoever moves vertices and
// whoever bounds their motion share.
#pragma once

#include <array>
#include <cstdint>

#include "core/mesh/registered_family.h"

namespace liquidblend::mesh {

using VertexRange = std::array<int32_t, 2>;  // vertices [begin, end)

// At this weight a vertex moves by
//   displacement_factor * displacement + extrapolation_factor * extrapolation.
struct TargetMotion {
  float displacement_factor = 0.0F;
  float extrapolation_factor = 0.0F;  // 0 if the target has no extrapolation of its own
};

// The piecewise-linear rule stated at FamilyTarget. Requires: weight finite.
inline TargetMotion MotionAt(const FamilyTarget& target, double weight) {
  const float w = static_cast<float>(weight);
  if (target.extrapolation.empty() || (w >= 0.0F && w <= 1.0F)) return {w, 0.0F};
  return w > 1.0F ? TargetMotion{1.0F, w - 1.0F} : TargetMotion{0.0F, w};
}

}  // namespace liquidblend::mesh

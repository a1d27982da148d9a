// Motion of a family's vertices with the blend weights, shared by the code that moves vertices and
// the code that bounds their motion; the interface by which a slice gets the vertices that it
// needs.
#pragma once

#include <cstdint>
#include <span>

#include "core/mesh/registered_family.h"

namespace liquidblend::mesh {

// Factors of a target at one weight. A vertex moves by
//   displacement_factor * displacement + extrapolation_factor * extrapolation.
struct TargetMotion {
  float displacement_factor = 0.0F;
  float extrapolation_factor = 0.0F;  // 0 if the target has no extrapolation of its own
};

// The factors of a target at a weight, by the piecewise-linear rule of FamilyTarget. Requires:
// weight finite.
inline TargetMotion MotionAt(const FamilyTarget& target, double weight) {
  const float w = static_cast<float>(weight);
  if (target.extrapolation.empty() || (w >= 0.0F && w <= 1.0F)) return {w, 0.0F};
  return w > 1.0F ? TargetMotion{1.0F, w - 1.0F} : TargetMotion{0.0F, w};
}

// Positions of a family's vertices in a blend.
class VertexPlacer {
 public:
  virtual ~VertexPlacer() = default;
  // Sets positions[i] to the position of vertices[i]: x, y, z in metres, t in ticks of the family's
  // time axis. The same vertex always gets the same position. Requires: they are vertices of the
  // family.
  virtual void Place(std::span<const int32_t> vertices, Float4* positions) const = 0;
  // Fetches memory for vertices that Place() will be called for soon.
  virtual void Prefetch(std::span<const int32_t> vertices) const = 0;
};

}  // namespace liquidblend::mesh

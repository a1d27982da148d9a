// Blend weights -> positions of a registered family's vertices (paper, equation 8), only where
// somebody will look.
#pragma once

#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/target_motion.h"

namespace liquidblend::blend {

inline constexpr double kMinWeight = -1.0;
inline constexpr double kMaxWeight = 2.0;

// Checks that there is one finite weight in [kMinWeight, kMaxWeight] per target of the family.
// Errors: kInvalidArgument; the message names the count, or the weight's index, target and value.
absl::Status CheckWeights(const mesh::RegisteredFamily& family, std::span<const double> weights);

// Moves the vertices of `ranges` by the sum of the targets' motions (see mesh::FamilyTarget). Then
// - x, y, z are clamped to the family's domain; a vertex that the source itself has outside of the
//   domain may stay as far outside, so that weight 0 is the source bit for bit;
// - t of the end slabs' vertices is clamped to the outside of [0, num_frames - 1], so that slices
//   are closed at any weights.
//   ranges     ascending, not overlapping
//   positions  grown if too small, never shrunk: the vertices of all ranges, one range after the
//              other; x, y, z in metres, t in frames
// Requires: family passed Validate(); CheckWeights().ok(); ranges inside the family.
// Threads: safe with a buffer per caller.  Cost: O(vertices in ranges x targets of weight != 0).
void BlendVertices(const mesh::RegisteredFamily& family, std::span<const double> weights,
                   std::span<const mesh::VertexRange> ranges, std::vector<mesh::Float4>& positions);

}  // namespace liquidblend::blend

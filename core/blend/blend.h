// Blend weights -> positions of a registered family's vertices (paper, equation 8), for requested
// vertices only.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/target_motion.h"

namespace liquidblend::blend {

// Range of weights.
inline constexpr double kMinWeight = -1.0;
inline constexpr double kMaxWeight = 2.0;

// Checks that there is one finite weight in [kMinWeight, kMaxWeight] per target of the family.
// Errors: kInvalidArgument; the message names the count, or the weight's index, target and value.
absl::Status CheckWeights(const mesh::RegisteredFamily& family, std::span<const double> weights);

// Blender of a family's vertices at given weights. Moves vertices by the sum of the targets'
// motions (see mesh::FamilyTarget). Then
// - x, y, z are clamped to the family's domain; a vertex that the source itself has outside of the
//   domain may stay as far outside, so that weight 0 is the source bit for bit;
// - t of the end slabs' vertices is clamped to the outside of [0, num_frames - 1], so that slices
//   are closed at any weights.
// Threads: safe, immutable.
class Blender final : public mesh::VertexPlacer {
 public:
  // Requires: family passed Validate() and outlives this; CheckWeights().ok().
  Blender(const mesh::RegisteredFamily& family, std::span<const double> weights);

  // Cost: O(vertices x targets of weight != 0).
  void Place(std::span<const int32_t> vertices, mesh::Float4* positions) const override;
  void Prefetch(std::span<const int32_t> vertices) const override;

 private:
  // factor * field[vertex] is added to the source's position.
  struct Term {
    float factor;
    const mesh::Float4* field;
  };

  const mesh::RegisteredFamily* family_;
  std::vector<Term> terms_;
  int64_t num_vertices_;
  float before_;  // the latest time of the slab before the first frame ...
  float after_;   // ... and the earliest of the one after the last
};

}  // namespace liquidblend::blend

// Blend that is asked for (weights, or a point in parameter space) -> the weights of a frame.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/blend/blend.h"
#include "core/frames/indexed_family.h"

namespace liquidblend::frames {

// One coordinate of a point in a family's parameter space.
struct Parameter {
  std::string name;
  double value = 0.0;
};

// Range of weights.
using blend::kMaxWeight;
using blend::kMinWeight;

// Weights of a frame, one per target.
struct BlendWeights {
  std::vector<double> weights;
  bool is_extrapolated = false;  // of a point outside of the hull in parameter space
  bool is_clamped = false;       // moved by blend::LifeLimits
};

// Checks that there is one finite weight in its range per target of the family.
// Errors: kInvalidArgument; the message names the count, or the weight's index, target and value.
absl::Status CheckWeights(const IndexedFamily& indexed, std::span<const double> weights);

// Clamps weights that violate the family's limits of lives. Weights out of range stay as they are:
// MakeSurface() refuses them.
BlendWeights ClampWeights(const IndexedFamily& indexed, std::vector<double> weights);

// The weights of a point in the family's parameter space, clamped.
//   point  every parameter once, in any order
// Errors: kFailedPrecondition (the family has no parameter space), kInvalidArgument (a parameter is
// unknown, missing, given twice or not finite), kOutOfRange (outside of the hull, unless
// extrapolating; or extrapolated beyond the range of weights). Messages name the parameter.
absl::StatusOr<BlendWeights> WeightsOfPoint(const IndexedFamily& indexed,
                                            std::span<const Parameter> point, bool extrapolate);

}  // namespace liquidblend::frames

// Parameter space: the points of a family's animations in the user's own parameters.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"

namespace liquidblend::mesh {

// The largest number of dimensions of a parameter space.
inline constexpr int kMaxParameters = 4;

// How a point between the animations becomes weights; the same numbers as in messages.
enum class Interpolation {
  kLinear = 1,  // linearly in the Delaunay simplex around it
  kSmooth = 2,  // by a smooth function through all animations
};

// Names of the parameters, and a point for each animation. Empty: the animations have no points.
struct ParameterSpace {
  std::vector<std::string> names;           // [a-z][a-z0-9_]{0,62}, all different
  std::vector<std::vector<double>> points;  // the source's, then one per target; a value per name
  Interpolation interpolation = Interpolation::kLinear;

  bool empty() const { return names.empty() && points.empty(); }
};

// Checks that the space is empty, or has 1 to kMaxParameters valid names, and for each animation a
// point of finite values, and an interpolation that is known. Errors: kInvalidArgument with the
// first name or point at fault.
absl::Status Validate(const ParameterSpace& space, int num_animations);

}  // namespace liquidblend::mesh

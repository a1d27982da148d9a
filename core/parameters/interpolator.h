// A point in a family's parameter space -> blend weights, as the space's interpolation says.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/option_ranges.h"
#include "core/mesh/parameter_space.h"
#include "core/parameters/smooth_interpolation.h"
#include "core/parameters/triangulation.h"

namespace liquidblend::parameters {

// The triangulation of a family's points and, if the family has it, their smooth interpolation.
// Threads: safe, immutable.
class Interpolator {
 public:
  // Requires: mesh::Validate(space, ...).ok(), not empty.
  // Errors: those of Triangulation::Make() and SmoothInterpolation::Make().  Cost: milliseconds.
  static absl::StatusOr<Interpolator> Make(const mesh::ParameterSpace& space);

  // The triangulation's location; of a smooth space with weights of its own. Where these go beyond
  // the limits, they are drawn towards those of the triangulation, no farther than to the limits.
  // Where even the latter go beyond them, far outside of the hull, they are the answer.
  //   limits  of a target's weight
  // Errors: Triangulation::Locate()'s.  Cost: microseconds.
  absl::StatusOr<Location> Locate(std::span<const double> point, Outside outside,
                                  const mesh::Range& limits) const;

  const std::vector<std::string>& names() const { return triangulation_.names(); }

 private:
  Interpolator(Triangulation triangulation, std::optional<SmoothInterpolation> smooth)
      : triangulation_(std::move(triangulation)), smooth_(std::move(smooth)) {}

  Triangulation triangulation_;
  std::optional<SmoothInterpolation> smooth_;
};

}  // namespace liquidblend::parameters

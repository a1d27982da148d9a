// A smooth function through values at points of a parameter space, as weights of these values.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"

namespace liquidblend::parameters {

// The interpolant s(x) = sum of c_i |x - x_i|^3 + p(x), where p is the quadratic polynomial if the
// points determine one well, otherwise the linear one, and the c_i give no such polynomial a part.
// So weights add up to 1, the same weights of the points are the point itself, and three points on
// a line have the quadratic through them. Some weights are negative between the points, or above 1.
// Threads: safe, immutable.
class SmoothInterpolation {
 public:
  // Requires: Triangulation::Make() takes the points; a column each, coordinates in [0, 1].
  // Errors: kInvalidArgument if there are too few points (three in one dimension, otherwise two
  // more than dimensions), or some are so close to one another that the weights are not exact.
  // Cost: milliseconds for tens of points.
  static absl::StatusOr<SmoothInterpolation> Make(const Eigen::MatrixXd& points);

  // One weight per point.  Cost: O(points^2), a microsecond for 17.
  Eigen::VectorXd WeightsAt(const Eigen::VectorXd& point) const;

  bool is_quadratic() const { return is_quadratic_; }

 private:
  SmoothInterpolation() = default;
  Eigen::VectorXd TermsAt(const Eigen::VectorXd& point) const;

  Eigen::MatrixXd points_;
  bool is_quadratic_ = false;
  Eigen::MatrixXd cardinals_;  // weights = cardinals * terms
};

}  // namespace liquidblend::parameters

#include "core/parameters/interpolator.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"

namespace liquidblend::parameters {
namespace {

// Whether the weights of the targets are those of one animation alone, the source or a target.
bool AreOfOne(const std::vector<double>& weights) {
  const auto num_zeros = std::count(weights.begin(), weights.end(), 0.0);
  const auto num_ones = std::count(weights.begin(), weights.end(), 1.0);
  return num_ones <= 1 && num_zeros + num_ones == static_cast<std::ptrdiff_t>(weights.size());
}

bool AreWithin(const mesh::Range& limits, const std::vector<double>& weights) {
  return std::all_of(weights.begin(), weights.end(),
                     [&](double weight) { return limits.Holds(weight); });
}

// The largest share of the way from `from` to `to` that stays within the limits.
// Requires: `from` does.
double ShareWithin(const mesh::Range& limits, const std::vector<double>& from,
                   const std::vector<double>& to) {
  double share = 1.0;
  for (size_t k = 0; k < from.size(); ++k) {
    if (limits.Holds(to[k])) continue;
    const double limit = to[k] < limits.min ? limits.min : limits.max;
    share = std::min(share, (limit - from[k]) / (to[k] - from[k]));
  }
  return share;
}

}  // namespace

absl::StatusOr<Interpolator> Interpolator::Make(const mesh::ParameterSpace& space) {
  LB_ASSIGN_OR_RETURN(Triangulation triangulation, Triangulation::Make(space));
  if (space.interpolation == mesh::Interpolation::kLinear) {
    return Interpolator(std::move(triangulation), std::nullopt);
  }
  Eigen::MatrixXd points(space.names.size(), space.points.size());
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    points.col(k) = triangulation.Scale(space.points[k]);
  }
  LB_ASSIGN_OR_RETURN(SmoothInterpolation smooth, SmoothInterpolation::Make(points));
  return Interpolator(std::move(triangulation), std::move(smooth));
}

absl::StatusOr<Location> Interpolator::Locate(std::span<const double> point, Outside outside,
                                              const mesh::Range& limits) const {
  LB_ASSIGN_OR_RETURN(Location location, triangulation_.Locate(point, outside));
  std::vector<double>& weights = location.weights;
  if (!smooth_.has_value() || AreOfOne(weights)) return location;
  const Eigen::VectorXd all = smooth_->WeightsAt(triangulation_.Scale(point));
  const std::vector<double> smooth(all.begin() + 1, all.end());  // the targets'
  const bool is_within = AreWithin(limits, smooth);
  if (!is_within && !AreWithin(limits, weights)) return location;
  const double share = is_within ? 1.0 : ShareWithin(limits, weights, smooth);
  for (size_t k = 0; k < weights.size(); ++k) {
    weights[k] = RoundedWeight(weights[k] + share * (smooth[k] - weights[k]));
  }
  return location;
}

}  // namespace liquidblend::parameters

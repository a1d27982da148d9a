// Convex hulls of a few points, by Qhull.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"

namespace liquidblend::parameters {

// One side of a hull; more points than dimensions if they lie in one hyperplane.
struct HullFacet {
  std::vector<int> points;  // columns, ascending
  Eigen::VectorXd normal;   // unit length, outward
};

// The facets of the hull of `points`, a column each; in no particular order, but always the same.
// Requires: one to five dimensions.  Errors: kInvalidArgument if they span fewer, or if Qhull fails
// for another reason, given in the message.
absl::StatusOr<std::vector<HullFacet>> FindHullFacets(const Eigen::MatrixXd& points);

}  // namespace liquidblend::parameters

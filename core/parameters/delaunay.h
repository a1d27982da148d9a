// Points in parameter space -> simplices between them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"

namespace liquidblend::parameters {

using Simplices = std::vector<std::vector<int>>;  // of columns, ascending; the list is sorted, too

// The Delaunay triangulation of `points`, a column each. Where more points than a simplex has lie
// on one empty sphere, as the corners of a rectangle, each of its simplices has the lowest of them:
// the diagonal of a rectangle starts at its first corner. (That makes neighbours fit: a face of a
// split cell is split by the same rule.) Flat simplices are left out.
// Requires: one to four dimensions, all coordinates in [0, 1] and none alike at all points; no two
// points nearer than flatness.  Errors: kInvalidArgument if Qhull finds no hull or leaves a point
// out.  Cost: milliseconds for tens of points.
//   flatness  simplices of a smaller height are flat
absl::StatusOr<Simplices> Triangulate(const Eigen::MatrixXd& points, double flatness);

// The gradients of the barycentric coordinates 1 to d of a simplex, a row each; of coordinate 0 it
// is minus their sum. The height of a corner above its opposite face is 1 / the gradient's length.
// Not finite for flat simplices.
Eigen::MatrixXd BarycentricGradients(const Eigen::MatrixXd& points,
                                     const std::vector<int>& simplex);

}  // namespace liquidblend::parameters

// The cross product of three vectors in R^4.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

namespace liquidblend::mesh {

// The vector n that is orthogonal to the three columns (a, b, c), as long as the volume they span,
// with det(a, b, c, n) = |n|^2 >= 0.
inline Eigen::Vector4f CrossProduct(const Eigen::Matrix<float, 4, 3>& columns) {
  Eigen::Vector4f normal;
  for (int row = 0; row < 4; ++row) {
    Eigen::Matrix3f minor;
    for (int r = 0, m = 0; r < 4; ++r) {
      if (r != row) minor.row(m++) = columns.row(r);
    }
    normal[row] = (row % 2 == 0 ? -1.0f : 1.0f) * minor.determinant();
  }
  return normal;
}

}  // namespace liquidblend::mesh

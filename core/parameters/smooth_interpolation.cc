#include "core/parameters/smooth_interpolation.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include "absl/strings/str_cat.h"

namespace liquidblend::parameters {
namespace {

// Of the matrix of quadratic monomials at the points, the smallest singular value with which they
// determine a quadratic well: below, weights reach 10 and more between points near a conic.
constexpr double kWellDetermined = 0.2;
constexpr double kExact = 1e-6;  // largest error of a weight at the points

Eigen::Index NumMonomials(Eigen::Index dimensions, bool is_quadratic) {
  return is_quadratic ? (dimensions + 1) * (dimensions + 2) / 2 : dimensions + 1;
}

// 1, the coordinates and, if asked for, their products; around the middle of the unit cube, where
// they differ most.
Eigen::VectorXd MonomialsAt(const Eigen::VectorXd& point, bool is_quadratic) {
  const Eigen::VectorXd centered = 2.0 * point.array() - 1.0;
  Eigen::VectorXd monomials(NumMonomials(point.size(), is_quadratic));
  monomials[0] = 1.0;
  monomials.segment(1, point.size()) = centered;
  if (!is_quadratic) return monomials;
  Eigen::Index n = 1 + point.size();
  for (Eigen::Index i = 0; i < point.size(); ++i) {
    for (Eigen::Index j = i; j < point.size(); ++j) monomials[n++] = centered[i] * centered[j];
  }
  return monomials;
}

bool DetermineQuadratic(const Eigen::MatrixXd& points) {
  const auto num_monomials = NumMonomials(points.rows(), true);
  if (points.cols() < num_monomials) return false;
  Eigen::MatrixXd monomials(num_monomials, points.cols());
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    monomials.col(k) = MonomialsAt(points.col(k), true);
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(monomials);
  return svd.singularValues()[num_monomials - 1] >= kWellDetermined;
}

}  // namespace

absl::StatusOr<SmoothInterpolation> SmoothInterpolation::Make(const Eigen::MatrixXd& points) {
  const auto num_points = points.cols();
  if (num_points < points.rows() + 2) {
    return absl::InvalidArgumentError(
        absl::StrCat("smooth interpolation of ", points.rows(),
                     points.rows() == 1 ? " parameter" : " parameters", " needs at least ",
                     points.rows() + 2, " animations, got ", num_points));
  }
  SmoothInterpolation result;
  result.points_ = points;
  result.is_quadratic_ = DetermineQuadratic(points);
  const auto size = num_points + NumMonomials(points.rows(), result.is_quadratic_);
  Eigen::MatrixXd equations = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index k = 0; k < num_points; ++k) {
    equations.col(k) = result.TermsAt(points.col(k));
    equations.row(k) = equations.col(k).transpose();
  }
  const Eigen::MatrixXd values = Eigen::MatrixXd::Identity(size, num_points);
  result.cardinals_ = equations.partialPivLu().solve(values).transpose();
  const Eigen::MatrixXd at_points = result.cardinals_ * equations.leftCols(num_points);
  const double error = (at_points - values.topRows(num_points)).cwiseAbs().maxCoeff();
  if (error <= kExact) return result;  // also false if it is not a number
  return absl::InvalidArgumentError(
      "some points are too close to one another for smooth interpolation");
}

Eigen::VectorXd SmoothInterpolation::TermsAt(const Eigen::VectorXd& point) const {
  const Eigen::VectorXd monomials = MonomialsAt(point, is_quadratic_);
  Eigen::VectorXd terms(points_.cols() + monomials.size());
  terms.head(points_.cols()) =
      (points_.colwise() - point).colwise().norm().transpose().array().cube();
  terms.tail(monomials.size()) = monomials;
  return terms;
}

Eigen::VectorXd SmoothInterpolation::WeightsAt(const Eigen::VectorXd& point) const {
  return cardinals_ * TermsAt(point);
}

}  // namespace liquidblend::parameters

#include "core/parameters/triangulation.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "core/parameters/delaunay.h"

namespace liquidblend::parameters {
namespace {

constexpr double kRounding = 1e-12;  // of coordinates and distances
constexpr double kSameFace = 1e-9;   // so far outside, a point is still one of the simplex
constexpr double kStep = 0x1p-30;    // weights are multiples of it
constexpr double kSameValue = 1e-9;  // relative; what differs by less may differ by rounding only
constexpr double kFarthest = 1e6;    // beyond it, coordinates say nothing; in scaled units

absl::Status Fault(const std::string& what) { return absl::InvalidArgumentError(what); }

// A column per animation, in the user's units.
Eigen::MatrixXd MatrixOf(const mesh::ParameterSpace& space) {
  Eigen::MatrixXd points(space.names.size(), space.points.size());
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    points.col(k) = Eigen::Map<const Eigen::VectorXd>(space.points[k].data(), points.rows());
  }
  return points;
}

absl::Status CheckRanges(const mesh::ParameterSpace& space, const Eigen::VectorXd& min,
                         const Eigen::VectorXd& range) {
  for (Eigen::Index i = 0; i < range.size(); ++i) {
    if (!std::isfinite(range[i])) {
      return Fault(absl::StrCat("the values of ", space.names[i], " span ", range[i]));
    }
    const double largest = std::max(std::abs(min[i]), std::abs(min[i] + range[i]));
    if (range[i] <= kSameValue * largest || !std::isfinite(1.0 / range[i])) {
      return Fault(
          absl::StrCat(space.names[i], " is ", min[i], " for all animations: leave it out"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckApart(const Eigen::MatrixXd& scaled) {
  for (Eigen::Index b = 1; b < scaled.cols(); ++b) {
    for (Eigen::Index a = 0; a < b; ++a) {
      if ((scaled.col(a) - scaled.col(b)).norm() > kSamePlace) continue;
      return Fault(absl::StrCat("points[", a, "] and points[", b, "] are at the same place"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckSpan(const mesh::ParameterSpace& space, const Eigen::MatrixXd& scaled) {
  const auto d = scaled.rows();
  const std::string names = absl::StrJoin(space.names, ", ");
  if (scaled.cols() <= d) {
    return Fault(absl::StrCat(d, " parameters (", names, ") need at least ", d + 1,
                              " animations, got ", scaled.cols()));
  }
  const Eigen::MatrixXd centered = scaled.colwise() - scaled.rowwise().mean().eval();
  const Eigen::VectorXd widths = Eigen::JacobiSVD<Eigen::MatrixXd>(centered).singularValues();
  if (widths[d - 1] > kTolerance) return absl::OkStatus();
  return Fault(absl::StrCat("the points of all ", scaled.cols(),
                            " animations lie in a subspace of ",
                            (widths.array() > kTolerance).count(), " of the ", d, " dimensions (",
                            names, "): leave parameters out, or add animations off it"));
}

// "wall_width 0.5, drop_height 1"
template <typename Values>
std::string Describe(const std::vector<std::string>& names, const Values& values) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i) {
    absl::StrAppend(&text, i == 0 ? "" : ", ", names[i], " ", values[i]);
  }
  return text;
}

// Whether a corner lies on the viewer's side of the plane through `at` that faces the viewer.
template <typename Corners, typename Point>
bool IsPartlyBefore(const Corners& corners, const Point& at, const Point& viewer) {
  const Point normal = viewer - at;
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    if (normal.dot(corners.col(i) - at) > kRounding) return true;
  }
  return false;
}

}  // namespace

double RoundedWeight(double weight) { return std::round(weight / kStep) * kStep; }

absl::StatusOr<Triangulation> Triangulation::Make(const mesh::ParameterSpace& space) {
  const Eigen::MatrixXd points = MatrixOf(space);
  Triangulation result;
  result.names_ = space.names;
  result.num_animations_ = static_cast<int>(points.cols());
  result.min_ = points.rowwise().minCoeff();
  result.range_ = points.rowwise().maxCoeff() - points.rowwise().minCoeff();
  LB_RETURN_IF_ERROR(CheckRanges(space, result.min_, result.range_));
  const Eigen::MatrixXd scaled =
      (points.colwise() - Eigen::VectorXd(result.min_)).array().colwise() /
      Eigen::ArrayXd(result.range_.array());
  LB_RETURN_IF_ERROR(CheckApart(scaled));
  LB_RETURN_IF_ERROR(CheckSpan(space, scaled));
  LB_ASSIGN_OR_RETURN(const Simplices simplices, Triangulate(scaled, kTolerance));
  for (const std::vector<int>& animations : simplices) {
    Simplex& simplex = result.simplices_.emplace_back();
    simplex.animations = animations;
    simplex.corners = scaled(Eigen::all, animations);
    simplex.gradients.resize(scaled.rows() + 1, scaled.rows());
    simplex.gradients.bottomRows(scaled.rows()) = BarycentricGradients(scaled, animations);
    simplex.gradients.row(0) = -simplex.gradients.bottomRows(scaled.rows()).colwise().sum();
  }
  return result;
}

std::vector<std::vector<int>> Triangulation::simplices() const {
  std::vector<std::vector<int>> result;
  for (const Simplex& simplex : simplices_) result.push_back(simplex.animations);
  return result;
}

Triangulation::Coordinates Triangulation::CoordinatesIn(const Simplex& simplex,
                                                        const Point& point) {
  Coordinates coordinates = simplex.gradients * (point - simplex.corners.col(0));
  coordinates[0] += 1.0;
  return coordinates;
}

// The point of the simplex that is closest to `point`: its projection to the simplex' own space or,
// if that lies outside, the closest point of a side that it lies behind.
Triangulation::Point Triangulation::ClosestIn(const Corners& corners, const Point& point) {
  const auto num_edges = corners.cols() - 1;
  if (num_edges == 0) return corners.col(0);
  const Corners edges = corners.rightCols(num_edges).colwise() - corners.col(0);
  Coordinates inner(corners.cols());
  inner.tail(num_edges) = edges.colPivHouseholderQr().solve(point - corners.col(0));
  inner[0] = 1.0 - inner.tail(num_edges).sum();
  if (inner.minCoeff() >= 0.0) return corners * inner;
  Point closest;
  double smallest = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    if (inner[i] >= 0.0) continue;
    Corners side(corners.rows(), num_edges);
    side.leftCols(i) = corners.leftCols(i);
    side.rightCols(num_edges - i) = corners.rightCols(num_edges - i);
    const Point candidate = ClosestIn(side, point);
    const double distance_sq = (candidate - point).squaredNorm();
    if (distance_sq >= smallest) continue;
    smallest = distance_sq;
    closest = candidate;
  }
  return closest;
}

const Triangulation::Simplex* Triangulation::FindAround(const Point& point) const {
  const auto around = std::find_if(simplices_.begin(), simplices_.end(), [&](const Simplex& s) {
    return CoordinatesIn(s, point).minCoeff() >= -kRounding;
  });
  return around == simplices_.end() ? nullptr : &*around;
}

// A simplex on the far side of the plane through the nearest point so far is not nearer; it is as
// near if it has that point.
Triangulation::Nearest Triangulation::FindNearest(const Point& point) const {
  Nearest best;
  for (const Simplex& simplex : simplices_) {
    const double squares = CoordinatesIn(simplex, point).squaredNorm();
    if (best.simplex == nullptr || IsPartlyBefore(simplex.corners, best.point, point)) {
      const Point closest = ClosestIn(simplex.corners, point);
      const double distance = (closest - point).norm();
      if (distance < best.distance - kRounding) best = {&simplex, closest, distance, squares};
    }
    const bool is_as_near = CoordinatesIn(simplex, best.point).minCoeff() >= -kSameFace;
    if (!is_as_near || squares >= best.squares) continue;
    best.simplex = &simplex;
    best.squares = squares;
  }
  return best;
}

Eigen::VectorXd Triangulation::Scale(std::span<const double> point) const {
  const Eigen::Map<const Eigen::VectorXd> values(point.data(), min_.size());
  return (values - min_).cwiseQuotient(range_);
}

absl::Status Triangulation::OutsideError(std::span<const double> point,
                                         const Nearest& nearest) const {
  const Point inside = min_ + range_.cwiseProduct(nearest.point);
  return absl::OutOfRangeError(absl::StrCat(
      "(", Describe(names_, point), ") lies outside of the hull of the family's points", ", by ",
      nearest.distance, " of the parameters' ranges; the nearest point of it ", "is (",
      Describe(names_, inside), ")"));
}

absl::StatusOr<Location> Triangulation::Locate(std::span<const double> point,
                                               Outside outside) const {
  if (point.size() != names_.size()) {
    return Fault(absl::StrCat(point.size(), " values for ", names_.size(), " parameters"));
  }
  for (size_t i = 0; i < point.size(); ++i) {
    if (!std::isfinite(point[i])) return Fault(absl::StrCat(names_[i], " is ", point[i]));
  }
  const Point scaled = Scale(point);
  if (!(scaled.cwiseAbs().maxCoeff() <= kFarthest)) {
    return absl::OutOfRangeError(absl::StrCat("(", Describe(names_, point), ") lies more than ",
                                              kFarthest, " times the parameters' ranges away"));
  }
  Location location;
  const Simplex* simplex = FindAround(scaled);
  if (simplex == nullptr) {
    const Nearest nearest = FindNearest(scaled);
    simplex = nearest.simplex;
    location.is_extrapolated = nearest.distance > kTolerance;
    if (location.is_extrapolated && outside == Outside::kRefuse)
      return OutsideError(point, nearest);
  }
  const Coordinates coordinates = CoordinatesIn(*simplex, scaled);
  location.weights.assign(num_animations_ - 1, 0.0);
  for (size_t i = 0; i < simplex->animations.size(); ++i) {
    const int animation = simplex->animations[i];
    if (animation > 0) location.weights[animation - 1] = RoundedWeight(coordinates[i]);
  }
  return location;
}

}  // namespace liquidblend::parameters

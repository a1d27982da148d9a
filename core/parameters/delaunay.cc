#include "core/parameters/delaunay.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <limits>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/parameters/hull.h"

namespace liquidblend::parameters {
namespace {

constexpr double kSteepest = 1e-9;  // of a facet below: the last component of its normal

// The points on the paraboloid above them, around the middle of the unit cube, and one point high
// over them, which hides what is above and lets the hull have a volume in any case.
Eigen::MatrixXd Lift(const Eigen::MatrixXd& points) {
  const auto d = points.rows();
  Eigen::MatrixXd lifted = Eigen::MatrixXd::Zero(d + 1, points.cols() + 1);
  lifted.topLeftCorner(d, points.cols()) = points.array() - 0.5;
  lifted.row(d) = lifted.topRows(d).colwise().squaredNorm();
  lifted(d, points.cols()) = 2.0 * static_cast<double>(d);
  return lifted;
}

// The corners of the cells between empty spheres: the lifted hull seen from below.
absl::StatusOr<Simplices> FindCells(const Eigen::MatrixXd& points) {
  const auto apex = static_cast<int>(points.cols());
  LB_ASSIGN_OR_RETURN(const std::vector<HullFacet> facets, FindHullFacets(Lift(points)));
  Simplices cells;
  for (const HullFacet& facet : facets) {
    const bool is_below = facet.normal[points.rows()] < -kSteepest;
    if (is_below && facet.points.back() != apex) cells.push_back(facet.points);
  }
  return cells;
}

// Points of a hyperplane in coordinates of its own, one fewer.
Eigen::MatrixXd FlattenedBy(const Eigen::MatrixXd& points) {
  const Eigen::MatrixXd edges = points.colwise() - points.col(0).eval();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(edges, Eigen::ComputeThinU);
  return svd.matrixU().leftCols(points.rows() - 1).transpose() * edges;
}

// Adds the simplices of a convex cell: its lowest point with those of each side opposite to it.
//   ids  of the columns of `points`, ascending
absl::Status Split(const Eigen::MatrixXd& points, const std::vector<int>& ids,
                   Simplices& simplices) {
  if (points.cols() == points.rows() + 1) {
    simplices.push_back(ids);
    return absl::OkStatus();
  }
  LB_ASSIGN_OR_RETURN(const std::vector<HullFacet> sides, FindHullFacets(points));
  for (const HullFacet& side : sides) {
    if (side.points.front() == 0) continue;
    std::vector<int> side_ids;
    for (const int column : side.points) side_ids.push_back(ids[column]);
    Simplices parts;
    const Eigen::MatrixXd corners = points(Eigen::all, side.points);
    LB_RETURN_IF_ERROR(Split(FlattenedBy(corners), side_ids, parts));
    for (std::vector<int>& part : parts) {
      part.insert(part.begin(), ids.front());
      simplices.push_back(std::move(part));
    }
  }
  return absl::OkStatus();
}

Simplices Intervals(const Eigen::MatrixXd& points) {
  std::vector<int> order(points.cols());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return points(0, a) < points(0, b); });
  Simplices intervals;
  for (size_t i = 1; i < order.size(); ++i) {
    intervals.push_back({std::min(order[i - 1], order[i]), std::max(order[i - 1], order[i])});
  }
  return intervals;
}

double SmallestHeight(const Eigen::MatrixXd& points, const std::vector<int>& simplex) {
  const Eigen::MatrixXd gradients = BarycentricGradients(points, simplex);
  if (!gradients.allFinite()) return 0.0;
  const double steepest = gradients.rowwise().norm().maxCoeff();
  return 1.0 / std::max(steepest, gradients.colwise().sum().norm());
}

absl::Status CheckAllUsed(const Simplices& simplices, int num_points) {
  std::vector<bool> is_used(num_points, false);
  for (const std::vector<int>& simplex : simplices) {
    for (const int point : simplex) is_used[point] = true;
  }
  const auto unused = std::find(is_used.begin(), is_used.end(), false);
  if (unused == is_used.end()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("points[", unused - is_used.begin(), "] is a corner of no Delaunay simplex: ",
                   "the points are too close to one another or to a subspace"));
}

}  // namespace

absl::StatusOr<Simplices> Triangulate(const Eigen::MatrixXd& points, double flatness) {
  Simplices simplices;
  if (points.rows() == 1) {
    simplices = Intervals(points);
  } else {
    LB_ASSIGN_OR_RETURN(const Simplices cells, FindCells(points));
    for (const std::vector<int>& cell : cells) {
      LB_RETURN_IF_ERROR(Split(points(Eigen::all, cell), cell, simplices));
    }
    std::erase_if(simplices, [&](const std::vector<int>& simplex) {
      return SmallestHeight(points, simplex) < flatness;
    });
  }
  LB_RETURN_IF_ERROR(CheckAllUsed(simplices, static_cast<int>(points.cols())));
  std::sort(simplices.begin(), simplices.end());
  return simplices;
}

Eigen::MatrixXd BarycentricGradients(const Eigen::MatrixXd& points,
                                     const std::vector<int>& simplex) {
  const auto d = points.rows();
  Eigen::MatrixXd edges(d, d);
  for (Eigen::Index i = 0; i < d; ++i) {
    edges.col(i) = points.col(simplex[i + 1]) - points.col(simplex[0]);
  }
  return edges.inverse();
}

}  // namespace liquidblend::parameters

// A point in a family's parameter space -> blend weights: its barycentric coordinates in the
// Delaunay simplex around it.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/parameter_space.h"

namespace liquidblend::parameters {

// Lengths are measured after each parameter has been scaled to run from 0 to 1 over the family's
// animations. Thinner simplices count as flat, and points this close to the hull as on it.
inline constexpr double kTolerance = 1e-6;
inline constexpr double kSamePlace = 1e-5;  // points nearer to one another are at one place

enum class Outside {
  kRefuse,
  kExtrapolate,  // by the nearest simplex
};

// A weight without its last bits, which are noise: a multiple of 2^-30.
double RoundedWeight(double weight);

struct Location {
  std::vector<double> weights;  // one per target; the source has 1 - sum
  bool is_extrapolated = false;
};

// The Delaunay triangulation of a family's points (see Triangulate() for equally good ones).
// Threads: safe, immutable.
class Triangulation {
 public:
  // Requires: mesh::Validate(space, ...).ok(), not empty.
  // Errors: kInvalidArgument if there are too few points, two at one place, or all in a subspace;
  // the message names them. Cost: milliseconds.
  static absl::StatusOr<Triangulation> Make(const mesh::ParameterSpace& space);

  // Outside of the hull, the coordinates in the nearest simplex, not clamped. Of equally near ones,
  // the one with the smallest sum of squared weights. Weights go on continuously across the hull,
  // but far from it they jump where another simplex becomes the nearest. They are rounded to
  // multiples of 2^-30, so that they are exact at the animations' own points.
  //   point  one value per name, in the user's units and the names' order
  // Errors: kInvalidArgument (not one finite value per name); kOutOfRange outside of the hull, with
  // the distance and the nearest point of the hull; also when extrapolating to more than a million
  // times the parameters' ranges.
  // Cost: microseconds.
  absl::StatusOr<Location> Locate(std::span<const double> point, Outside outside) const;

  // The point in units of the parameters' ranges, in which the hull is within [0, 1].
  Eigen::VectorXd Scale(std::span<const double> point) const;

  const std::vector<std::string>& names() const { return names_; }
  // Animations at the corners of each simplex, ascending; 0 is the source.
  std::vector<std::vector<int>> simplices() const;
  int num_simplices() const { return static_cast<int>(simplices_.size()); }

 private:
  static constexpr int kMaxCorners = mesh::kMaxParameters + 1;
  using Point = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, mesh::kMaxParameters, 1>;
  using Coordinates = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxCorners, 1>;
  using Corners =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, mesh::kMaxParameters, kMaxCorners>;
  struct Simplex {
    std::vector<int> animations;  // ascending; 0 is the source
    Corners corners;
    // Of all barycentric coordinates: coordinates = gradients * (point - corner 0) + (1, 0, ...).
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxCorners, mesh::kMaxParameters>
        gradients;
  };
  struct Nearest {
    const Simplex* simplex = nullptr;
    Point point;
    double distance = std::numeric_limits<double>::infinity();
    double squares = 0.0;  // sum of the coordinates'
  };

  Triangulation() = default;
  static Coordinates CoordinatesIn(const Simplex& simplex, const Point& point);
  static Point ClosestIn(const Corners& corners, const Point& point);
  const Simplex* FindAround(const Point& point) const;
  Nearest FindNearest(const Point& point) const;
  absl::Status OutsideError(std::span<const double> point, const Nearest& nearest) const;

  std::vector<std::string> names_;
  int num_animations_ = 0;
  Point min_;    // in the user's units
  Point range_;  // likewise; > 0
  std::vector<Simplex> simplices_;
};

}  // namespace liquidblend::parameters

#include "worker/spacetime/field/point_grid.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace liquidblend::spacetime {
namespace {

constexpr double kMaxCubesPerPoint = 8.0;

struct Box {
  PointCube lowest, dims;
};

// One cube wider than the others on all sides.
Box BoxAround(const std::vector<PointCube>& cubes) {
  if (cubes.empty()) return {{0, 0, 0}, {0, 0, 0}};
  PointCube lowest = cubes[0], highest = cubes[0];
  for (const PointCube& cube : cubes) {
    for (int axis = 0; axis < 3; ++axis) {
      lowest[axis] = std::min(lowest[axis], cube[axis]);
      highest[axis] = std::max(highest[axis], cube[axis]);
    }
  }
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lowest[axis] = lowest[axis] - 1;
    box.dims[axis] = highest[axis] - lowest[axis] + 3;
  }
  return box;
}

double NumCubes(const PointCube& dims) {
  return static_cast<double>(dims[0]) * static_cast<double>(dims[1]) * static_cast<double>(dims[2]);
}

}  // namespace

PointGrid::PointGrid(const Eigen::Matrix3Xf& points, float radius) : radius_(radius) {
  const auto num_points = static_cast<size_t>(points.cols());
  std::vector<PointCube> cubes(num_points);
  for (size_t p = 0; p < num_points; ++p) cubes[p] = CubeOf(points.col(static_cast<int64_t>(p)));
  const Box box = BoxAround(cubes);
  lowest_ = box.lowest;
  dims_ = box.dims;
  is_hashed_ = NumCubes(dims_) > kMaxCubesPerPoint * static_cast<double>(num_points + 27);
  // The last one stays empty where cubes are not hashed.
  const size_t num_buckets = is_hashed_ ? std::bit_ceil(num_points + 1)
                                        : static_cast<size_t>(dims_[0] * dims_[1] * dims_[2]) + 1;
  for (int n = 0; n < 27; ++n) {
    const PointCube step = Neighbor({0, 0, 0}, n);
    step_[n] = is_hashed_ ? 0 : (step[2] * dims_[1] + step[1]) * dims_[0] + step[0];
  }
  first_.assign(num_buckets + 1, 0);
  std::vector<size_t> buckets(num_points);
  for (size_t p = 0; p < num_points; ++p) {
    buckets[p] = BucketOf(cubes[p]);
    ++first_[buckets[p] + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<int32_t> next = first_;
  entries_.resize(num_points);
  if (is_hashed_) cubes_.resize(num_points);
  for (size_t p = 0; p < num_points; ++p) {
    const int32_t at = next[buckets[p]]++;
    entries_[at] = {points.col(static_cast<int64_t>(p)), static_cast<int32_t>(p)};
    if (is_hashed_) cubes_[at] = cubes[p];
  }
}

PointCube PointGrid::CubeOf(const Eigen::Vector3f& at) const {
  constexpr double kFarthest = 1e15;  // keeps any finite position within the range of the type
  PointCube cube;
  for (int axis = 0; axis < 3; ++axis) {
    const double c = std::clamp(static_cast<double>(at[axis]) / radius_, -kFarthest, kFarthest);
    const auto truncated = static_cast<int64_t>(c);
    cube[axis] = static_cast<double>(truncated) > c ? truncated - 1 : truncated;
  }
  return cube;
}

size_t PointGrid::BucketOf(const PointCube& cube) const {
  if (is_hashed_) {
    const auto hash = static_cast<uint64_t>(cube[0]) * 0x9E3779B97F4A7C15u ^
                      static_cast<uint64_t>(cube[1]) * 0xC2B2AE3D27D4EB4Fu ^
                      static_cast<uint64_t>(cube[2]) * 0x165667B19E3779F9u;
    return (hash ^ hash >> 29) & (num_buckets() - 1);
  }
  int64_t bucket = 0;
  for (int axis = 2; axis >= 0; --axis) {
    const int64_t at = cube[axis] - lowest_[axis];
    if (at < 0 || at >= dims_[axis]) return num_buckets() - 1;
    bucket = bucket * dims_[axis] + at;
  }
  return static_cast<size_t>(bucket);
}

}  // namespace liquidblend::spacetime

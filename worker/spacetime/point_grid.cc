#include "worker/spacetime/point_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace liquidblend::spacetime {

PointGrid::PointGrid(const Eigen::Matrix3Xf& points, float radius)
    : radius_(radius), first_(std::bit_ceil(static_cast<size_t>(points.cols()) + 1) + 1, 0) {
  std::vector<PointCube> cubes(points.cols());
  for (size_t p = 0; p < cubes.size(); ++p) {
    cubes[p] = CubeOf(points.col(static_cast<Eigen::Index>(p)));
    ++first_[BucketOf(cubes[p]) + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<int32_t> next = first_;
  entries_.resize(cubes.size());
  for (size_t p = 0; p < cubes.size(); ++p) {
    entries_[next[BucketOf(cubes[p])]++] = {cubes[p], points.col(static_cast<Eigen::Index>(p)),
                                            static_cast<int32_t>(p)};
  }
}

PointCube PointGrid::CubeOf(const Eigen::Vector3f& at) const {
  constexpr double kFarthest = 1e15;  // keeps any finite position within the range of the type
  PointCube cube;
  for (int axis = 0; axis < 3; ++axis) {
    const double c = std::floor(static_cast<double>(at[axis]) / radius_);
    cube[axis] = static_cast<int64_t>(std::clamp(c, -kFarthest, kFarthest));
  }
  return cube;
}

size_t PointGrid::BucketOf(const PointCube& cube) const {
  const auto hash = static_cast<uint64_t>(cube[0]) * 0x9E3779B97F4A7C15u ^
                    static_cast<uint64_t>(cube[1]) * 0xC2B2AE3D27D4EB4Fu ^
                    static_cast<uint64_t>(cube[2]) * 0x165667B19E3779F9u;
  return (hash ^ hash >> 29) & (first_.size() - 2);
}

}  // namespace liquidblend::spacetime

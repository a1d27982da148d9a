// Points in space, hashed into cubes, to find those near a place. Internal to worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace liquidblend::spacetime {

// A place among the cubes.
using PointCube = std::array<int64_t, 3>;

// Memory: 40 bytes a point and 4 a bucket, of which there are one to two a point.
class PointGrid {
 public:
  // Requires: radius > 0, finite points.
  PointGrid(const Eigen::Matrix3Xf& points, float radius);

  // Calls visit(index) once for each point closer to `at` than the radius, always in the same
  // order; leaves out the points of buckets for which is_wanted(bucket) is false.
  template <typename IsWanted, typename Visit>
  void ForEachNear(const Eigen::Vector3f& at, IsWanted&& is_wanted, Visit&& visit) const {
    const PointCube centre = CubeOf(at);
    for (int n = 0; n < 27; ++n) {
      const PointCube cube = Neighbor(centre, n);
      const size_t bucket = BucketOf(cube);
      if (first_[bucket] == first_[bucket + 1] || !is_wanted(bucket)) continue;
      for (int32_t e = first_[bucket]; e < first_[bucket + 1]; ++e) {
        if (!AreSame(entries_[e].cube, cube)) continue;
        if ((entries_[e].point - at).squaredNorm() < radius_ * radius_) visit(entries_[e].index);
      }
    }
  }
  template <typename Visit>
  void ForEachNear(const Eigen::Vector3f& at, Visit&& visit) const {
    ForEachNear(
        at, [](size_t) { return true; }, visit);
  }

  // The cubes that ForEachNear looks at are the neighbours 0 to 26 of the point's own one.
  // Different cubes may share a bucket.
  PointCube CubeOf(const Eigen::Vector3f& at) const;
  static PointCube Neighbor(const PointCube& cube, int n) {
    return {cube[0] + n % 3 - 1, cube[1] + n / 3 % 3 - 1, cube[2] + n / 9 - 1};
  }
  size_t num_buckets() const { return first_.size() - 1; }
  size_t BucketOf(const PointCube& cube) const;

 private:
  struct Entry {
    PointCube cube;
    Eigen::Vector3f point;
    int32_t index;
  };

  // Without a call for each entry, which comparing the arrays costs.
  static bool AreSame(const PointCube& a, const PointCube& b) {
    return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
  }
  float radius_;
  std::vector<int32_t> first_;  // per bucket, and the end
  std::vector<Entry> entries_;  // by bucket, then by index
};

}  // namespace liquidblend::spacetime

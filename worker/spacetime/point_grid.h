// Points in space, hashed into cubes, to find those near a place. Internal to worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace liquidblend::spacetime {

// Memory: 40 bytes a point and 4 a bucket, of which there are one to two a point.
class PointGrid {
 public:
  // Requires: radius > 0, finite points.
  PointGrid(const Eigen::Matrix3Xf& points, float radius);

  // Calls visit(index) once for each point closer to `at` than the radius, always in the same
  // order.
  template <typename Visit>
  void ForEachNear(const Eigen::Vector3f& at, Visit&& visit) const {
    const Cube centre = CubeOf(at);
    for (int n = 0; n < 27; ++n) {
      const Cube cube = {centre[0] + n % 3 - 1, centre[1] + n / 3 % 3 - 1, centre[2] + n / 9 - 1};
      const size_t bucket = BucketOf(cube);
      for (int32_t e = first_[bucket]; e < first_[bucket + 1]; ++e) {
        if (!AreSame(entries_[e].cube, cube)) continue;
        if ((entries_[e].point - at).squaredNorm() < radius_ * radius_) visit(entries_[e].index);
      }
    }
  }

 private:
  using Cube = std::array<int64_t, 3>;
  struct Entry {
    Cube cube;
    Eigen::Vector3f point;
    int32_t index;
  };

  // Without a call for each entry, which comparing the arrays costs.
  static bool AreSame(const Cube& a, const Cube& b) {
    return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
  }
  Cube CubeOf(const Eigen::Vector3f& at) const;
  size_t BucketOf(const Cube& cube) const;

  float radius_;
  std::vector<int32_t> first_;  // per bucket, and the end
  std::vector<Entry> entries_;  // by bucket, then by index
};

}  // namespace liquidblend::spacetime

// Points in space, sorted into cubes, to find those near a place. Internal to worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace liquidblend::spacetime {

// A place among the cubes.
using PointCube = std::array<int64_t, 3>;

// A bucket for each cube of the box around the points, or, where these lie far apart, hashed cubes.
// Memory: 40 bytes a point and 4 a bucket, of which there are up to eight a point.
class PointGrid {
 public:
  // Requires: radius > 0, finite points.
  PointGrid(const Eigen::Matrix3Xf& points, float radius);

  // Calls visit(index) once for each point closer to `at` than the radius, always in the same
  // order; leaves out the points of buckets for which is_wanted(bucket) is false.
  template <typename IsWanted, typename Visit>
  void ForEachNear(const Eigen::Vector3f& at, IsWanted&& is_wanted, Visit&& visit) const {
    ForEachBucket(CubeOf(at), [&](size_t bucket, const PointCube& cube) {
      if (first_[bucket] == first_[bucket + 1] || !is_wanted(bucket)) return;
      for (int32_t e = first_[bucket]; e < first_[bucket + 1]; ++e) {
        if (!cubes_.empty() && !AreSame(cubes_[e], cube)) continue;
        if ((entries_[e].point - at).squaredNorm() < radius_ * radius_) visit(entries_[e].index);
      }
    });
  }
  template <typename Visit>
  void ForEachNear(const Eigen::Vector3f& at, Visit&& visit) const {
    ForEachNear(
        at, [](size_t) { return true; }, visit);
  }

  // Calls visit(index) for all points, bucket by bucket.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (const Entry& entry : entries_) visit(entry.index);
  }
  // Calls visit(bucket, cube) for the cubes that ForEachNear visits around a cube: its neighbours 0
  // to 26. Hashed cubes may share a bucket; those beyond the box share an empty one.
  template <typename Visit>
  void ForEachBucket(const PointCube& centre, Visit&& visit) const {
    if (!is_hashed_ && IsWithin(centre)) {
      const size_t middle = BucketOf(centre);
      for (int n = 0; n < 27; ++n) visit(middle + step_[n], centre);
      return;
    }
    for (int n = 0; n < 27; ++n) {
      const PointCube cube = Neighbor(centre, n);
      visit(BucketOf(cube), cube);
    }
  }
  PointCube CubeOf(const Eigen::Vector3f& at) const;
  size_t num_buckets() const { return first_.size() - 1; }
  size_t BucketOf(const PointCube& cube) const;

 private:
  struct Entry {
    Eigen::Vector3f point;
    int32_t index;
  };

  static PointCube Neighbor(const PointCube& cube, int n) {
    return {cube[0] + n % 3 - 1, cube[1] + n / 3 % 3 - 1, cube[2] + n / 9 - 1};
  }
  // Compares entry by entry, which is faster than comparing the arrays.
  static bool AreSame(const PointCube& a, const PointCube& b) {
    return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
  }
  // Whether the cube and all its neighbours are in the box.
  bool IsWithin(const PointCube& cube) const {
    bool is_within = true;
    for (int axis = 0; axis < 3; ++axis) {
      is_within &= cube[axis] > lowest_[axis] && cube[axis] < lowest_[axis] + dims_[axis] - 1;
    }
    return is_within;
  }

  float radius_;
  bool is_hashed_ = false;
  PointCube lowest_ = {0, 0, 0}, dims_ = {0, 0, 0};  // of the box, one cube wider than the points
  std::array<int64_t, 27> step_;                     // from a cube's bucket to its neighbours'
  std::vector<int32_t> first_;                       // per bucket, and the end
  std::vector<Entry> entries_;                       // by bucket, then by index
  std::vector<PointCube> cubes_;                     // of the entries, if they are hashed
};

}  // namespace liquidblend::spacetime

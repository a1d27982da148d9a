#include "worker/ingest/formats/polygons.h"

#include <Eigen/Geometry>
#include <limits>
#include <span>

#include "absl/strings/str_cat.h"

namespace liquidblend::ingest {
namespace {

using Eigen::Vector3d;

// Whether the diagonal from corner 1 to corner 3 is better than that from 0 to 2.
bool PrefersSecondDiagonal(std::span<const int32_t> quad, const Eigen::Matrix3Xf& vertices) {
  Vector3d p[4];
  for (int c = 0; c < 4; ++c) p[c] = vertices.col(quad[c]).cast<double>();
  const Vector3d first = p[2] - p[0];
  const Vector3d second = p[3] - p[1];
  const auto facing = [](const Vector3d& a, const Vector3d& b, const Vector3d& c,
                         const Vector3d& d) { return a.cross(b).dot(c.cross(d)) > 0; };
  const bool first_works = facing(p[1] - p[0], first, first, p[3] - p[0]);
  const bool second_works = facing(p[2] - p[1], second, second, p[0] - p[1]);
  if (first_works != second_works) return second_works;
  return second.squaredNorm() < first.squaredNorm();
}

absl::StatusOr<int64_t> CheckFaces(const Polygons& polygons, int64_t num_vertices) {
  int64_t num_triangles = 0;
  size_t corner = 0;
  const int64_t first = polygons.first_number;
  for (size_t face = 0; face < polygons.num_corners.size(); ++face) {
    const int32_t num_corners = polygons.num_corners[face];
    const int64_t number = static_cast<int64_t>(face) + first;
    if (num_corners < 3) {
      return absl::InvalidArgumentError(
          absl::StrCat("face ", number, " has ", num_corners, " corners"));
    }
    for (const size_t end = corner + num_corners; corner < end; ++corner) {
      const int32_t v = polygons.corners[corner];
      if (v >= 0 && v < num_vertices) continue;
      return absl::InvalidArgumentError(absl::StrCat("face ", number, ": vertex ", v + first,
                                                     " is not in [", first, ", ",
                                                     num_vertices + first, ")"));
    }
    num_triangles += num_corners - 2;
  }
  if (num_triangles > std::numeric_limits<int32_t>::max() / 3) {
    return absl::InvalidArgumentError(absl::StrCat(num_triangles, " triangles are too many"));
  }
  return num_triangles;
}

}  // namespace

absl::StatusOr<Eigen::Matrix3Xi> Triangulate(const Polygons& polygons,
                                             const Eigen::Matrix3Xf& vertices) {
  const absl::StatusOr<int64_t> num_triangles = CheckFaces(polygons, vertices.cols());
  if (!num_triangles.ok()) return num_triangles.status();
  Eigen::Matrix3Xi triangles(3, *num_triangles);
  int64_t t = 0;
  std::span<const int32_t> rest = polygons.corners;
  for (const int32_t num_corners : polygons.num_corners) {
    const std::span<const int32_t> face = rest.first(num_corners);
    rest = rest.subspan(num_corners);
    const int apex = num_corners == 4 && PrefersSecondDiagonal(face, vertices) ? 1 : 0;
    for (int c = 1; c + 1 < num_corners; ++c) {
      triangles.col(t++) << face[apex], face[(apex + c) % num_corners],
          face[(apex + c + 1) % num_corners];
    }
  }
  return triangles;
}

}  // namespace liquidblend::ingest

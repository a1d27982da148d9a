#include "worker/registration/features/height_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace liquidblend::registration {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kRounding = 1e-9;  // of barycentric coordinates; leaves no gap between triangles

std::array<int, 2> PlaceAxes(const mesh::HeightAxis& up) {
  return {up.axis == 0 ? 1 : 0, up.axis == 2 ? 1 : 2};
}

// For each vertex, whether it belongs to the part with the most vertices; ties go to the first one.
std::vector<char> InLargestPart(const mesh::TriangleMesh& surface) {
  const std::vector<int32_t> roots = mesh::ComponentRoots(surface);
  std::vector<int32_t> sizes(roots.size(), 0);
  for (const int32_t root : roots) ++sizes[root];
  const auto largest = std::max_element(sizes.begin(), sizes.end()) - sizes.begin();
  std::vector<char> inside;
  inside.reserve(roots.size());
  for (const int32_t root : roots) inside.push_back(root == largest ? 1 : 0);
  return inside;
}

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

Eigen::Vector2d PlaceOf(const Eigen::Vector3d& point, const mesh::HeightAxis& up) {
  const auto [i, j] = PlaceAxes(up);
  return {point[i], point[j]};
}

Eigen::Vector3d PointAt(const Eigen::Vector2d& place, double height, const mesh::HeightAxis& up) {
  const auto [i, j] = PlaceAxes(up);
  Eigen::Vector3d point;
  point[i] = place[0];
  point[j] = place[1];
  point[up.axis] = up.sign * height;
  return point;
}

HeightField::HeightField(const mesh::TriangleMesh& surface, const mesh::HeightAxis& up,
                         const Eigen::Vector2d& centre, double half_width, double spacing,
                         Seen seen)
    : low_(centre.array() - half_width),
      spacing_(spacing),
      size_(static_cast<int>(std::ceil(2 * half_width / spacing)) + 1),
      heights_(static_cast<size_t>(size_) * size_, kNone) {
  std::vector<char> inside(surface.num_vertices(), 1);
  if (seen == Seen::kLargestPart) inside = InLargestPart(surface);
  for (int64_t t = 0; t < surface.num_triangles(); ++t) {
    if (inside[surface.triangles(0, t)] == 0) continue;
    Eigen::Matrix3d corners;  // in columns: place in grid steps, height
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d point = surface.vertices.col(surface.triangles(k, t)).cast<double>();
      corners.col(k) << (PlaceOf(point, up) - low_) / spacing_, up.sign * point[up.axis];
    }
    AddTriangle(corners);
  }
}

// The highest surface wins, whichever way it faces: above liquid there is always one that faces up.
void HeightField::AddTriangle(const Eigen::Matrix3d& corners) {
  const Eigen::Vector2d a = corners.col(0).head<2>(), b = corners.col(1).head<2>(),
                        c = corners.col(2).head<2>();
  const double area = Cross(b - a, c - a);
  if (!(std::abs(area) > 0)) return;
  const Eigen::Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const int last_j = static_cast<int>(std::min<double>(size_ - 1, std::floor(high.y())));
  const int last_i = static_cast<int>(std::min<double>(size_ - 1, std::floor(high.x())));
  for (int j = static_cast<int>(std::max(0.0, std::ceil(low.y()))); j <= last_j; ++j) {
    for (int i = static_cast<int>(std::max(0.0, std::ceil(low.x()))); i <= last_i; ++i) {
      const Eigen::Vector2d p(i, j);
      const double u = Cross(b - p, c - p) / area, v = Cross(c - p, a - p) / area;
      if (std::min({u, v, 1 - u - v}) < -kRounding) continue;
      const double height = corners.row(2).dot(Eigen::RowVector3d(u, v, 1 - u - v));
      double& highest = Point(i, j);
      if (!(highest >= height)) highest = height;
    }
  }
}

double HeightField::At(const Eigen::Vector2d& place) const {
  const Eigen::Vector2d step = (place - low_) / spacing_;
  if (!(step.minCoeff() >= 0 && step.maxCoeff() < size_ - 1)) return kNone;
  const int i = static_cast<int>(step.x()), j = static_cast<int>(step.y());
  const double x = step.x() - i, y = step.y() - j;
  return (1 - y) * ((1 - x) * At(i, j) + x * At(i + 1, j)) +
         y * ((1 - x) * At(i, j + 1) + x * At(i + 1, j + 1));
}

}  // namespace liquidblend::registration

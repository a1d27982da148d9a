#include "core/mesh/triangle_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/base/status_macros.h"
#include "core/mesh/components.h"
#include "core/mesh/union_find.h"

namespace liquidblend::mesh {
namespace {

constexpr char kAxis[] = "xyzt";

template <typename Columns>
absl::Status CheckFinite(const Columns& columns, absl::string_view what, int first_vertex) {
  for (Eigen::Index v = 0; v < columns.cols(); ++v) {
    for (int axis = 0; axis < columns.rows(); ++axis) {
      if (std::isfinite(columns(axis, v))) continue;
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v + first_vertex, ": ", what, " ",
                                                     std::string(1, kAxis[axis]), " is ",
                                                     columns(axis, v), ", not a finite number"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckCount(const TriangleMesh& mesh, Eigen::Index count, const char* name) {
  if (count == 0 || count == mesh.vertices.cols()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(count, " ", name, " for ", mesh.vertices.cols(), " vertices"));
}

// Signed volume of the tetrahedron from `origin` to a triangle, positive if `origin` is behind the
// triangle.
double TetrahedronVolume(const TriangleMesh& mesh, Eigen::Index triangle,
                         const Eigen::Vector3d& origin) {
  const Eigen::Vector3d a = mesh.vertices.col(mesh.triangles(0, triangle)).cast<double>() - origin;
  const Eigen::Vector3d b = mesh.vertices.col(mesh.triangles(1, triangle)).cast<double>() - origin;
  const Eigen::Vector3d c = mesh.vertices.col(mesh.triangles(2, triangle)).cast<double>() - origin;
  return a.dot(b.cross(c)) / 6.0;
}

}  // namespace

ClosednessReport CheckClosed(const TriangleMesh& mesh) {
  // Sides of triangles as (edge, direction), the edge as its two vertices in order. A side from a
  // vertex to itself is no boundary.
  std::vector<std::pair<uint64_t, int>> sides;
  sides.reserve(3 * mesh.num_triangles());
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto a = static_cast<uint32_t>(mesh.triangles(k, t));
      const auto b = static_cast<uint32_t>(mesh.triangles((k + 1) % 3, t));
      if (a == b) continue;
      const uint64_t edge = uint64_t{std::min(a, b)} << 32 | std::max(a, b);
      sides.emplace_back(edge, a < b ? 1 : -1);
    }
  }
  std::sort(sides.begin(), sides.end());
  ClosednessReport report;
  for (size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    int64_t direction = 0;
    for (end = begin; end < sides.size() && sides[end].first == sides[begin].first; ++end) {
      direction += sides[end].second;
    }
    if ((end - begin) % 2 != 0) ++report.num_odd_edges;
    if (direction != 0) ++report.num_misoriented_edges;
    if (end - begin > 2) ++report.num_non_manifold_edges;
  }
  return report;
}

absl::Status Validate(const TriangleMesh& mesh, int first_vertex) {
  LB_RETURN_IF_ERROR(CheckFinite(mesh.vertices, "position", first_vertex));
  LB_RETURN_IF_ERROR(CheckCount(mesh, mesh.velocities.cols(), "velocities"));
  LB_RETURN_IF_ERROR(CheckFinite(mesh.velocities, "velocity", first_vertex));
  LB_RETURN_IF_ERROR(CheckCount(mesh, mesh.normals.cols(), "normals"));
  LB_RETURN_IF_ERROR(CheckFinite(mesh.normals, "normal", first_vertex));
  LB_RETURN_IF_ERROR(CheckCount(mesh, mesh.rest.cols(), "rest positions"));
  LB_RETURN_IF_ERROR(CheckFinite(mesh.rest, "rest position", first_vertex));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int v = mesh.triangles(k, t);
      if (v >= 0 && v < mesh.num_vertices()) continue;
      return absl::InvalidArgumentError(absl::StrCat("triangle ", t, ": vertex ", v,
                                                     " is not in [0, ", mesh.num_vertices(), ")"));
    }
  }
  return absl::OkStatus();
}

double Volume(const TriangleMesh& mesh) {
  if (mesh.num_triangles() == 0) return 0.0;
  // With the origin at a vertex of the mesh the terms are small, wherever the mesh lies.
  const Eigen::Vector3d origin = mesh.vertices.col(mesh.triangles(0, 0)).cast<double>();
  double volume = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    volume += TetrahedronVolume(mesh, t, origin);
  }
  return volume;
}

double MeanEdgeLength(const TriangleMesh& mesh) {
  if (mesh.num_triangles() == 0) return 0.0;
  double sum = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles(k, t);
      const int b = mesh.triangles((k + 1) % 3, t);
      sum += (mesh.vertices.col(a) - mesh.vertices.col(b)).cast<double>().norm();
    }
  }
  return sum / (3.0 * static_cast<double>(mesh.num_triangles()));
}

std::vector<int32_t> ComponentRoots(const TriangleMesh& mesh) {
  UnionFind sets(mesh.num_vertices());
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (int k = 1; k < 3; ++k) sets.Join(mesh.triangles(0, t), mesh.triangles(k, t));
  }
  std::vector<int32_t> roots(mesh.num_vertices());
  for (size_t v = 0; v < roots.size(); ++v) roots[v] = sets.Root(static_cast<int32_t>(v));
  return roots;
}

int64_t NumComponents(const TriangleMesh& mesh) {
  const std::vector<int32_t> root = ComponentRoots(mesh);
  std::vector<char> used(mesh.num_vertices(), 0);
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) used[root[mesh.triangles(0, t)]] = 1;
  return std::count(used.begin(), used.end(), 1);
}

std::vector<double> ComponentVolumes(const TriangleMesh& mesh) {
  std::vector<double> volumes;
  for (const Component& component : FindComponents(mesh)) volumes.push_back(component.volume);
  std::sort(volumes.rbegin(), volumes.rend());
  return volumes;
}

}  // namespace liquidblend::mesh

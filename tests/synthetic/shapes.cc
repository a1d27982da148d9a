#include "tests/synthetic/shapes.h"

#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace liquidblend::synthetic {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;
using mesh::TriangleMesh;

TriangleMesh FromLists(const std::vector<Vector3d>& vertices,
                       const std::vector<Vector3i>& triangles) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t v = 0; v < vertices.size(); ++v) mesh.vertices.col(v) = vertices[v].cast<float>();
  for (size_t t = 0; t < triangles.size(); ++t) mesh.triangles.col(t) = triangles[t];
  return mesh;
}

// The icosahedron on the unit sphere.
void Icosahedron(std::vector<Vector3d>& vertices, std::vector<Vector3i>& triangles) {
  const double g = std::numbers::phi;
  vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
              {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (Vector3d& v : vertices) v.normalize();
  triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
               {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
               {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
}

// Each triangle becomes four; new vertices are put onto the unit sphere.
void Subdivide(std::vector<Vector3d>& vertices, std::vector<Vector3i>& triangles) {
  std::map<std::pair<int, int>, int> middle;
  const auto middle_of = [&](int a, int b) {
    const auto [entry, is_new] =
        middle.try_emplace(std::minmax(a, b), static_cast<int>(vertices.size()));
    if (is_new) vertices.push_back((vertices[a] + vertices[b]).normalized());
    return entry->second;
  };
  std::vector<Vector3i> finer;
  finer.reserve(4 * triangles.size());
  for (const Vector3i& t : triangles) {
    const int ab = middle_of(t[0], t[1]);
    const int bc = middle_of(t[1], t[2]);
    const int ca = middle_of(t[2], t[0]);
    finer.insert(finer.end(), {{t[0], ab, ca}, {t[1], bc, ab}, {t[2], ca, bc}, {ab, bc, ca}});
  }
  triangles = std::move(finer);
}

}  // namespace

TriangleMesh Icosphere(const Vector3f& centre_m, double radius_m, int subdivisions) {
  std::vector<Vector3d> vertices;
  std::vector<Vector3i> triangles;
  Icosahedron(vertices, triangles);
  for (int i = 0; i < subdivisions; ++i) Subdivide(vertices, triangles);
  for (Vector3d& v : vertices) v = centre_m.cast<double>() + radius_m * v;
  return FromLists(vertices, triangles);
}

TriangleMesh Box(const Vector3f& min_m, const Vector3f& max_m, int cells_per_side) {
  const int n = cells_per_side;
  std::map<std::array<int, 3>, int> index;
  std::vector<Vector3d> vertices;
  std::vector<Vector3i> triangles;
  const auto vertex = [&](const std::array<int, 3>& corner) {
    const auto [entry, is_new] = index.try_emplace(corner, static_cast<int>(vertices.size()));
    if (is_new) {
      const Vector3d share = Vector3d(corner[0], corner[1], corner[2]) / n;
      vertices.push_back(min_m.cast<double>() + share.cwiseProduct((max_m - min_m).cast<double>()));
    }
    return entry->second;
  };
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2;
    const bool is_max = side % 2 == 1;
    for (int i = 0; i < n * n; ++i) {
      std::array<int, 4> quad;
      for (int c = 0; c < 4; ++c) {
        std::array<int, 3> corner;
        corner[axis] = is_max ? n : 0;
        corner[(axis + 1) % 3] = i % n + (c == 1 || c == 2 ? 1 : 0);
        corner[(axis + 2) % 3] = i / n + (c >= 2 ? 1 : 0);
        quad[c] = vertex(corner);
      }
      if (!is_max) std::swap(quad[1], quad[3]);
      triangles.emplace_back(quad[0], quad[1], quad[2]);
      triangles.emplace_back(quad[0], quad[2], quad[3]);
    }
  }
  return FromLists(vertices, triangles);
}

TriangleMesh Torus(const Vector3f& centre_m, double major_radius_m, double minor_radius_m,
                   int num_major, int num_minor) {
  std::vector<Vector3d> vertices;
  std::vector<Vector3i> triangles;
  const auto vertex = [&](int i, int j) { return i % num_major * num_minor + j % num_minor; };
  for (int i = 0; i < num_major; ++i) {
    for (int j = 0; j < num_minor; ++j) {
      const double u = 2 * std::numbers::pi * i / num_major;
      const double v = 2 * std::numbers::pi * j / num_minor;
      const double r = major_radius_m + minor_radius_m * std::cos(v);
      vertices.emplace_back(centre_m.cast<double>() + Vector3d(r * std::cos(u), r * std::sin(u),
                                                               minor_radius_m * std::sin(v)));
      triangles.emplace_back(vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1));
      triangles.emplace_back(vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1));
    }
  }
  return FromLists(vertices, triangles);
}

TriangleMesh Flipped(TriangleMesh mesh) {
  mesh.triangles.row(1).swap(mesh.triangles.row(2));
  return mesh;
}

TriangleMesh Join(std::span<const TriangleMesh> parts) {
  int64_t num_vertices = 0;
  int64_t num_triangles = 0;
  bool with_velocities = true;
  for (const TriangleMesh& part : parts) {
    num_vertices += part.num_vertices();
    num_triangles += part.num_triangles();
    with_velocities = with_velocities && part.velocities.cols() == part.vertices.cols();
  }
  TriangleMesh joined;
  joined.vertices.resize(3, num_vertices);
  joined.triangles.resize(3, num_triangles);
  if (with_velocities) joined.velocities.resize(3, num_vertices);
  int64_t v = 0;
  int64_t t = 0;
  for (const TriangleMesh& part : parts) {
    joined.vertices.middleCols(v, part.num_vertices()) = part.vertices;
    joined.triangles.middleCols(t, part.num_triangles()) =
        part.triangles.array() + static_cast<int>(v);
    if (with_velocities) joined.velocities.middleCols(v, part.num_vertices()) = part.velocities;
    v += part.num_vertices();
    t += part.num_triangles();
  }
  return joined;
}

TriangleMesh BallWithBubble(const Vector3f& centre_m, double outer_radius_m, double bubble_radius_m,
                            int subdivisions) {
  return Join(std::array{Icosphere(centre_m, outer_radius_m, subdivisions),
                         Flipped(Icosphere(centre_m, bubble_radius_m, subdivisions))});
}

TriangleMesh Soup(const TriangleMesh& mesh) {
  TriangleMesh soup;
  soup.vertices.resize(3, 3 * mesh.num_triangles());
  soup.triangles.resize(3, mesh.num_triangles());
  for (int t = 0; t < mesh.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      soup.vertices.col(3 * t + k) = mesh.vertices.col(mesh.triangles(k, t));
      soup.triangles(k, t) = 3 * t + k;
    }
  }
  return soup;
}

mesh::Animation MovingSphere(const MovingSphereOptions& options) {
  assert(options.num_frames >= 1 && options.frames_per_second > 0);
  mesh::Animation animation;
  animation.name = "moving sphere";
  animation.frames_per_second = options.frames_per_second;
  const TriangleMesh unit = Icosphere({0, 0, 0}, 1.0, options.subdivisions);
  for (int k = 0; k < options.num_frames; ++k) {
    const double time_s = k / options.frames_per_second;
    const double radius_m = options.radius_m + options.growth_m_per_s * time_s;
    const Vector3f centre_m =
        options.centre_m + options.velocity_m_per_s * static_cast<float>(time_s);
    TriangleMesh frame = unit;
    frame.vertices = (unit.vertices * static_cast<float>(radius_m)).colwise() + centre_m;
    frame.velocities = (unit.vertices * static_cast<float>(options.growth_m_per_s)).colwise() +
                       options.velocity_m_per_s;
    animation.frames.push_back(std::move(frame));
  }
  return animation;
}

}  // namespace liquidblend::synthetic

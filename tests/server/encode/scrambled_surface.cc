#include "tests/server/encode/scrambled_surface.h"

namespace liquidblend::encode {

void ScrambledSurface::TurnEdge(uint64_t triangle, uint64_t edge) {
  Eigen::Matrix3Xi& triangles = mesh_.triangles;
  const auto here = static_cast<Eigen::Index>(triangle % triangles.cols());
  const auto k_here = static_cast<int>(edge % 3);
  const int a = triangles(k_here, here);
  const int b = triangles((k_here + 1) % 3, here);
  const int c = triangles((k_here + 2) % 3, here);
  for (Eigen::Index across = 0; across < triangles.cols(); ++across) {
    for (int k = 0; k < 3; ++k) {
      if (triangles(k, across) != b || triangles((k + 1) % 3, across) != a) continue;
      const int d = triangles((k + 2) % 3, across);
      if (d == c || across == here) return;
      triangles.col(here) = Eigen::Vector3i(a, d, c);
      triangles.col(across) = Eigen::Vector3i(d, b, c);
      return;
    }
  }
}

void ScrambledSurface::MergeVertices(uint64_t from, uint64_t to) {
  const auto old_vertex = static_cast<int>(from % mesh_.num_vertices());
  const auto new_vertex = static_cast<int>(to % mesh_.num_vertices());
  for (int& v : mesh_.triangles.reshaped()) v = v == old_vertex ? new_vertex : v;
}

void ScrambledSurface::DropTriangle(uint64_t triangle) {
  mesh_.triangles.col(static_cast<Eigen::Index>(triangle % mesh_.triangles.cols())).setConstant(0);
}

mesh::TriangleMesh WithoutDegenerate(const mesh::TriangleMesh& mesh) {
  mesh::TriangleMesh out = mesh;
  Eigen::Index num_kept = 0;
  for (Eigen::Index t = 0; t < mesh.num_triangles(); ++t) {
    const Eigen::Vector3i v = mesh.triangles.col(t);
    if (v[0] != v[1] && v[1] != v[2] && v[2] != v[0]) out.triangles.col(num_kept++) = v;
  }
  out.triangles.conservativeResize(Eigen::NoChange, num_kept);
  return out;
}

}  // namespace liquidblend::encode

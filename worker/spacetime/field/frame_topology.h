// Topology of a frame: triangles by vertex and by edge. Internal to worker/spacetime.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::spacetime {

using Corners = std::array<int32_t, 3>;

inline Corners CornersOf(const mesh::TriangleMesh& frame, int64_t triangle) {
  const auto column = frame.triangles.col(triangle);
  return {column[0], column[1], column[2]};
}

// A triangle that names a vertex twice bounds nothing.
inline bool IsDegenerate(const Corners& c) { return c[0] == c[1] || c[1] == c[2] || c[2] == c[0]; }

// Triangles by vertex. Requires: the frame outlives it, indices in range.
class FrameTopology {
 public:
  explicit FrameTopology(const mesh::TriangleMesh& frame);

  int32_t num_vertices() const { return static_cast<int32_t>(first_.size()) - 1; }
  // The triangles around a vertex, ascending.
  std::span<const int32_t> TrianglesAt(int32_t v) const {
    return std::span(triangles_).subspan(first_[v], first_[v + 1] - first_[v]);
  }
  // The first triangle that runs through these corners in this cyclic order, or -1.
  int32_t Find(const Corners& corners) const;
  // The third corner of the first triangle that runs from a to b, or -1.
  int32_t Opposite(int32_t a, int32_t b) const;
  // Whether a path along edges from a to b is shorter than the limit.  Cost: Dijkstra.
  bool IsNear(int32_t a, int32_t b, float limit) const;

 private:
  const mesh::TriangleMesh* frame_;
  std::vector<int32_t> first_;  // per vertex, and the end
  std::vector<int32_t> triangles_;
};

// Outward unit normals of the vertices; zero where there is no area.
Eigen::Matrix3Xf VertexNormals(const mesh::TriangleMesh& frame);

}  // namespace liquidblend::spacetime

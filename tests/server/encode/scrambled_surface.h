// Closed surfaces whose connectivity is made as odd as can be.
#pragma once

#include <cstdint>
#include <utility>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::encode {

// Vertices get any valence from 2 on, edges any even number of triangles. Numbers of triangles,
// edges and vertices are taken modulo how many there are, so any will do.
class ScrambledSurface {
 public:
  // Requires: mesh has triangles.
  explicit ScrambledSurface(mesh::TriangleMesh mesh) : mesh_(std::move(mesh)) {}

  // The triangles a, b, c and b, a, d become a, d, c and d, b, c; not if c and d are the same.
  void TurnEdge(uint64_t triangle, uint64_t edge);
  // Surfaces touch there, and triangles at an edge between the two name a vertex twice.
  void MergeVertices(uint64_t from, uint64_t to);
  // Leaves a hole.
  void DropTriangle(uint64_t triangle);

  const mesh::TriangleMesh& mesh() const { return mesh_; }

 private:
  mesh::TriangleMesh mesh_;
};

mesh::TriangleMesh WithoutDegenerate(const mesh::TriangleMesh& mesh);

}  // namespace liquidblend::encode

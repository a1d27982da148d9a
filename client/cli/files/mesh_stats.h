// Figures of a triangle mesh.
//
// Why not those of core/mesh: they take the worker's mesh of Eigen matrices. The client library,
// which is installed without core, has a mesh of plain arrays (docs/architecture.md, rule 1).
#pragma once

#include <cstdint>
#include <vector>

#include "liquidblend/bounds.h"
#include "liquidblend/mesh.h"

namespace liquidblend::cli {

struct MeshStats {
  int64_t num_vertices = 0;
  int64_t num_triangles = 0;
  int64_t num_components = 0;         // parts connected through triangles
  int64_t num_odd_edges = 0;          // edges with an odd number of triangles
  int64_t num_misoriented_edges = 0;  // edges run through more often in one direction
  double volume_m3 = 0.0;             // signed; means something if closed
  double area_m2 = 0.0;
  double mean_edge_length_m = 0.0;  // each triangle side counted once per triangle
  Bounds bounds;

  bool closed() const { return num_odd_edges == 0 && num_misoriented_edges == 0; }
};

// Requires: indices in range.  Cost: O(n log n).
MeshStats ComputeMeshStats(const Mesh& mesh);

// A unit normal per vertex, mean of the triangles around weighted by area; 0, 0, 1 for vertices
// without a triangle. x, y, z per vertex.
std::vector<float> VertexNormals(const Mesh& mesh);

}  // namespace liquidblend::cli

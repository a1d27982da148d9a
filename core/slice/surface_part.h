// A part of a slice: the surface in some of its clusters, which come one after another. Parts are
// made side by side and then joined.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/slice/cut_cluster.h"

namespace liquidblend::slice {

// A vertex and the edge of the family that it lies on.
struct PartVertex {
  std::array<float, 3> point;  // metres
  int32_t near_vertex;         // the lower end
  int32_t far_vertex;          // the higher one
};

// Vertices on the edges that belong to a cluster: they follow one another in its part.
struct alignas(64) ClusterVertices {
  CrossedEdges crossed;
  int32_t first_vertex = 0;

  // The vertex on a crossed edge that belongs to the cluster; undefined for other edges.
  int32_t VertexOn(int edge) const { return first_vertex + crossed.NumBefore(edge); }
};

// A vertex on an edge that belongs to a cluster of an earlier part.
struct OuterVertex {
  PartVertex itself;
  int32_t cluster;      // that the edge belongs to
  int32_t edge;         // its number there
  int32_t vertex = -1;  // of the whole surface; set by JoinParts()
};

// Surface in the clusters from first_cluster on, up to the next part's. Keeps its memory from one
// slice to the next: only the first num_... entries are valid.
struct SurfacePart {
  int32_t first_cluster = 0;
  size_t num_vertices = 0;
  size_t num_triangles = 0;
  std::vector<PartVertex> vertices;
  // Of vertices; -1 - k is outer[k].
  std::vector<std::array<int32_t, 3>> triangles;
  std::vector<OuterVertex> outer;
  // Of the whole surface: the part's first ones; set by JoinParts().
  size_t first_vertex = 0;
  size_t first_triangle = 0;

  // Empties the part, which begins at cluster `first` now.
  void Clear(int32_t first) {
    first_cluster = first;
    num_vertices = num_triangles = 0;
    outer.clear();
  }

  // Whether this vertex exists and lies on the edge with these ends.
  bool Has(int32_t vertex, int32_t near, int32_t far) const {
    if (vertex < 0 || static_cast<size_t>(vertex) >= num_vertices) return false;
    return vertices[vertex].near_vertex == near && vertices[vertex].far_vertex == far;
  }
};

}  // namespace liquidblend::slice

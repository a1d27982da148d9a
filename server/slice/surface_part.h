// A part of a slice: the surface in some of its clusters, which come one after another. Parts are
// made side by side and then joined.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace liquidblend::slice {

// A vertex and the edge of the family that it lies on.
struct PartVertex {
  std::array<float, 3> point;  // metres
  int32_t near_vertex;         // the lower end
  int32_t far_vertex;          // the higher one
};

// A vertex on an edge that belongs to a cluster of an earlier part.
struct OuterVertex {
  PartVertex itself;
  int32_t cluster;      // that the edge belongs to
  int32_t edge;         // its number there
  int32_t vertex = -1;  // of the whole surface; set by JoinParts()
};

// Keeps its memory from one slice to the next: only the first num_... entries count.
struct SurfacePart {
  int32_t first_cluster = 0;
  size_t num_vertices = 0;
  size_t num_triangles = 0;
  size_t num_crossings = 0;
  std::vector<PartVertex> vertices;
  // Of vertices; -1 - k is outer[k].
  std::vector<std::array<int32_t, 3>> triangles;
  std::vector<int32_t> crossings;  // per edge of the clusters in turn: its vertex, or anything
  std::vector<OuterVertex> outer;
  // Of the whole surface: the part's first ones; set by JoinParts().
  size_t first_vertex = 0;
  size_t first_triangle = 0;

  void Clear(int32_t first) {
    first_cluster = first;
    num_vertices = num_triangles = num_crossings = 0;
    outer.clear();
  }

  // The vertex on edge `crossing` of crossings; -1 if it is none of these two's.
  int32_t Find(int64_t crossing, int32_t near, int32_t far) const {
    if (crossing >= static_cast<int64_t>(num_crossings)) return -1;
    const int32_t v = crossings[crossing];
    const bool is_vertex = v >= 0 && static_cast<size_t>(v) < num_vertices;
    if (!is_vertex) return -1;
    return vertices[v].near_vertex == near && vertices[v].far_vertex == far ? v : -1;
  }
};

}  // namespace liquidblend::slice

// A triangle mesh as plain arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace liquidblend {

// Triangles are counter-clockwise seen from outside.
struct Mesh {
  std::vector<float> positions;     // x, y, z per vertex, metres
  std::vector<uint32_t> triangles;  // three vertex indices per triangle

  size_t num_vertices() const { return positions.size() / 3; }
  size_t num_triangles() const { return triangles.size() / 3; }
};

}  // namespace liquidblend

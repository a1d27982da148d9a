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
  std::vector<float> normals;       // x, y, z per vertex, about unit length; or empty: not known
  std::vector<float> velocities;    // x, y, z per vertex, metres per second; or empty: not known

  // x, y, z (metres) and time (seconds) per vertex: its place in the source, the same for a place
  // of the liquid at any weights; or empty: not known.
  std::vector<float> rest;

  size_t num_vertices() const { return positions.size() / 3; }
  size_t num_triangles() const { return triangles.size() / 3; }
};

}  // namespace liquidblend

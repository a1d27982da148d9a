// Part of a triangle mesh that encoders write: proper triangles, and the vertices that they use.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::frames {

// Triangles without repeated vertices, in their order, and the vertices that they use, renumbered
// by first use.
struct UsedPart {
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<int32_t> vertices;  // of the mesh
};

// Requires: mesh passed Validate().  Cost: O(triangles + vertices).
UsedPart FindUsedPart(const mesh::TriangleMesh& mesh);

}  // namespace liquidblend::frames

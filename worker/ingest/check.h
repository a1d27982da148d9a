// Is a mesh a closed, oriented manifold, and where is it not?
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::ingest {

// Per triangle, the triangles across its sides; side k joins corners k and (k + 1) % 3.
using Neighbours = std::vector<std::array<int32_t, 3>>;

// Requires: indices in range, no triangle with a vertex twice.
// Errors: kInvalidArgument with the lowest edge (a, b) that does not have exactly two triangles
// running through it in opposite directions.  Cost: O(n log n), 96 bytes a triangle.
absl::StatusOr<Neighbours> FindNeighbours(const mesh::TriangleMesh& mesh);

// Per vertex, whether it lies on an edge with one triangle. Requires and cost: as FindNeighbours.
std::vector<bool> FindOpenVertices(const mesh::TriangleMesh& mesh);

// Gives each fan of triangles its own copy of the vertex it turns around (position and velocity),
// so that no vertex is pinched any more. Returns how many copies were made.
// Requires: neighbours of this mesh; they stay valid.
int64_t SplitPinchedVertices(const Neighbours& neighbours, mesh::TriangleMesh& mesh);

// Errors: kInvalidArgument if there are triangles and their signed volume is not above 0.
absl::Status CheckOutward(const mesh::TriangleMesh& mesh);

}  // namespace liquidblend::ingest

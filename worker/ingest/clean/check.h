// Checks that a mesh is a closed, oriented surface; neighbours of triangles, pinched vertices.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::ingest {

// Per triangle, the triangles across its sides; side k joins corners k and (k + 1) % 3.
using Neighbours = std::vector<std::array<int32_t, 3>>;

// Triangles paired along their edges.
struct Pairing {
  Neighbours neighbours;
  int64_t num_non_manifold = 0;  // edges of four triangles or more
};

// Numbering of vertices in the file, for messages.
enum class VertexNumbers { kFromZero, kFromOne, kNone };

// Pairs the triangles along each edge; at non-manifold ones, those that bound a wedge of liquid.
// Requires: indices in range, finite numbers, no triangle with a vertex twice.
// Errors: kInvalidArgument with the lowest edge (a, b) that is not run through as often in one
// direction as in the other, its positions, and how many holes there are.
// Cost: O(n log n), 96 bytes a triangle.
absl::StatusOr<Pairing> FindNeighbours(const mesh::TriangleMesh& mesh,
                                       VertexNumbers numbers = VertexNumbers::kFromZero);

// Per vertex, whether it lies on an edge that FindNeighbours refuses. Requires and cost: as there.
std::vector<bool> FindOpenVertices(const mesh::TriangleMesh& mesh);

// The sides (3 * triangle + side) along non-manifold edges that run from the lower vertex to the
// higher one, without the first of each edge; ascending by edge. Requires and cost: as
// FindNeighbours.
std::vector<int32_t> FindSharedSides(const mesh::TriangleMesh& mesh);

// Gives each fan of triangles its own copy of the vertex it turns around (position and velocity),
// so that no vertex is pinched any more. Returns how many copies were made.
// Requires: neighbours of this mesh; they stay valid.
int64_t SplitPinchedVertices(const Neighbours& neighbours, mesh::TriangleMesh& mesh);

}  // namespace liquidblend::ingest

// Repair of non-manifold edges: edges of four triangles or more, where parts of the liquid touch.
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/mesh/triangle_mesh.h"
#include "worker/ingest/clean/check.h"

namespace liquidblend::ingest {

// The most triangles a vertex of a mesh with non-manifold edges; meshes that fill space mostly have
// 6. It bounds the memory that a file of a few vertices can ask for.
inline constexpr int64_t kMaxTrianglesPerVertex = 16;

// Reorders the sides (3 * triangle + side) along one edge: the sides at 2 i and 2 i + 1 bound a
// wedge of liquid, wedges do not cross. Where triangles lie on one another, liquid ends first.
// Requires: as many sides in one direction as in the other.  Cost: O(n log n).
void PairAcrossLiquid(const mesh::TriangleMesh& mesh, std::span<int32_t> sides);

// Drops triangles that have the same corners in opposite directions, two by two: a wall between
// two parts of the liquid, or a sheet without volume. Returns how many.
// Requires: no triangle with a vertex twice.  Cost: O(n log n).
int64_t DropBackToBack(mesh::TriangleMesh& mesh);

// Where surfaces that are apart share both ends of an edge, gives each but one a vertex of its own
// half-way (mean position and velocity). Returns the number of vertices added.
// Requires: neighbours of this mesh, no vertex pinched, no triangles back to back; if it is not 0,
// the neighbours are not valid any more.
// Errors: kInvalidArgument if it would be more than one for two triangles.  Cost: O(n log n).
absl::StatusOr<int64_t> HalveSharedEdges(const Neighbours& neighbours, mesh::TriangleMesh& mesh);

}  // namespace liquidblend::ingest

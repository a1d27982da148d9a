// Repair of a frame into a closed, oriented manifold, with counts of the repairs.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/triangle_mesh.h"
#include "worker/ingest/clean/check.h"

namespace liquidblend::ingest {

struct CleanCounts {
  int64_t num_repeated = 0;      // triangles with a corner twice, dropped
  int64_t num_welded = 0;        // vertices on open edges that lay on another one, merged into it
  int64_t num_back_to_back = 0;  // triangles on one another, walls between parts, dropped
  int64_t num_non_manifold = 0;  // edges of four triangles or more, where parts touch, taken apart
  int64_t num_halved = 0;        // of the non-manifold edges, got a vertex half-way
  int64_t num_split = 0;         // copies of pinched vertices, added
  int64_t num_slivers = 0;       // removed
  int64_t num_slivers_left = 0;
  int64_t num_specks = 0;  // parts without extent or volume, dropped
  int64_t num_unused = 0;  // vertices without a triangle, dropped; those merged or collapsed too
  int64_t num_turned = 0;  // parts that were inside out, turned outward
  Eigen::Vector3f first_turned = Eigen::Vector3f::Zero();  // a vertex of the first of them; metres
};

// Repairs in place; afterwards the mesh is a closed, oriented manifold, with positive volume unless
// it has no triangles. Vertices keep their order. Parts of the liquid that touch in a vertex or an
// edge are apart then, those that share a wall are one. Parts that are inside out face outward.
//   numbers  how messages number the vertices
// Requires: Validate(mesh).  Errors: kInvalidArgument, naming an edge (FindNeighbours), or the
// signed volume (outward.h); the mesh is invalid then.  Threads: safe.  Cost: O(n log n).
absl::StatusOr<CleanCounts> Clean(mesh::TriangleMesh& mesh,
                                  VertexNumbers numbers = VertexNumbers::kFromZero);

// Describes the repairs, one sentence for each kind. Frame k is called names[k].
std::vector<std::string> Notes(std::span<const CleanCounts> frames,
                               std::span<const std::string> names);

}  // namespace liquidblend::ingest

// Blended vertices -> the liquid's surface at one time, by marching cells (paper, section 8).
//
// Two steps, so that only the vertices that matter are ever blended:
//   slice::Workspace workspace;             // one per thread, reused
//   std::vector<mesh::Float4> positions;    // likewise
//   LB_RETURN_IF_ERROR(slice::FindCandidates(index, weights, time_s, workspace));
//   blend::BlendVertices(family, weights, workspace.vertex_ranges, positions);
//   const mesh::TriangleMesh surface = slice::March(index, positions, workspace);
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/target_motion.h"
#include "core/mesh/triangle_mesh.h"
#include "server/slice/cell_index.h"

namespace liquidblend::slice {

// What one slice needs besides its input; keeps its memory from one slice to the next.
struct Workspace {
  // Set by FindCandidates: whose positions March() needs.
  std::vector<mesh::VertexRange> vertex_ranges;  // ascending, not overlapping, not touching
  int64_t num_vertices = 0;                      // in all ranges

  // The stage's own.
  double time_frames = 0.0;
  std::vector<int32_t> clusters;         // that may cross, ascending
  std::vector<float> earliest, latest;   // per cluster, frames
  std::vector<uint8_t> is_block_needed;  // per vertex block
  std::vector<int32_t> block_offset;     // per vertex block: where its positions begin
  std::vector<uint8_t> is_later;         // per blended vertex: t >= time_frames
  std::vector<int32_t> first_crossing;   // per blended vertex: head of its list of crossings

  // Set by March(): the edge that each output vertex lies on, as indices of the positions.
  std::vector<int32_t> near_vertex;  // its lower vertex
  std::vector<int32_t> far_vertex;   // its higher vertex

  // March()'s own.
  std::vector<int32_t> next_crossing;  // per output vertex: the next one of the same lower one
  std::vector<std::array<float, 3>> vertices;     // output, metres
  std::vector<std::array<int32_t, 3>> triangles;  // output
};

// Finds the clusters of cells that may cross the hyperplane t = time_s, and their vertices.
// Requires: weights are one per target of the family, finite.
// Errors: kOutOfRange if time_s is not in [0, duration_s] (the message names both).
// Cost: O(clusters x targets).
absl::Status FindCandidates(const CellIndex& index, std::span<const double> weights, double time_s,
                            Workspace& workspace);

// Cuts the candidate cells. Every facet is cut alike by both of its cells, from the signs of
// t - time_s at its corners alone, and each mesh edge is crossed in one point, so the result is a
// closed, oriented surface however the vertices were moved. One vertex per crossed mesh edge,
// numbered as first used; no triangle names a vertex twice, some may have no area. An edge has two
// triangles, more only where parts of the liquid touch in the mesh itself.
//   positions  as BlendVertices leaves them for workspace.vertex_ranges; finite
// Requires: workspace as FindCandidates() left it for the same index.
// Threads: safe with a workspace per caller; the same bytes always.
// Cost: O(candidate cells), times the crossed edges per vertex where many cross.
mesh::TriangleMesh March(const CellIndex& index, std::span<const mesh::Float4> positions,
                         Workspace& workspace);

}  // namespace liquidblend::slice

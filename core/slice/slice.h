// Blended vertices -> the liquid's surface at one time, by marching cells (paper, section 8).
//
// Two steps, of which the second asks for the vertices that it needs, cluster by cluster, so that
// they are blended only where the surface is, and used while they are in the first-level cache:
//   slice::Workspace workspace;  // one per thread, reused
//   LB_RETURN_IF_ERROR(slice::FindCandidates(index, weights, time_s, workspace));
//   const mesh::TriangleMesh surface =
//       slice::March(index, blend::Blender(family, weights), workspace);
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/target_motion.h"
#include "core/mesh/triangle_mesh.h"
#include "core/parallel/helpers.h"
#include "core/slice/cell_index.h"
#include "core/slice/surface_part.h"

namespace liquidblend::slice {

// Workspace of one slice; keeps its memory from one slice to the next.
struct Workspace {
  // Not owned: March() ends soon after it has become true; or null.
  const std::atomic<bool>* stop = nullptr;
  // Not owned: threads that may help in March(); or null.
  parallel::Helpers* helpers = nullptr;

  // Set by FindCandidates().
  double time_ticks = 0.0;        // of the slice, as the family's time axis counts
  std::vector<TimeTerm> terms;    // of the weights
  std::vector<int32_t> clusters;  // that may cross, ascending

  // Set by March(): the edge that each output vertex lies on, as vertices of the family.
  std::vector<int32_t> near_vertex;  // the lower one
  std::vector<int32_t> far_vertex;   // the higher one

  // The stage's own.
  std::vector<float> earliest, latest;            // per group of clusters, ticks
  std::vector<ClusterVertices> cluster_vertices;  // per cluster; of earlier slices, too
  std::vector<SurfacePart> parts;                 // and those of earlier slices, for their memory
};

// Finds the clusters of cells that may cross the hyperplane t = time_s.
// Requires: weights are one per target of the family, finite.
// Errors: kOutOfRange if time_s is not in [0, duration_s] (the message names both).
// Cost: O((groups of clusters + clusters near the time) x targets).
absl::Status FindCandidates(const CellIndex& index, std::span<const double> weights, double time_s,
                            Workspace& workspace);

// Cuts the candidate cells. Every facet is cut alike by both of its cells, from the signs of t -
// time_s at its corners alone, and each mesh edge is crossed in one point. So the result is a
// closed, oriented surface however the vertices were moved.
// There is one vertex per crossed mesh edge, numbered in the order of the clusters that the edges
// belong to. No triangle names a vertex twice, some may have no area. An edge has two triangles,
// more only where parts of the liquid touch in the mesh itself. If workspace.stop becomes true, the
// result is a part of the surface, not closed.
//   placer  finite; its times are those of FindCandidates()'s weights
// Requires: workspace as FindCandidates() left it for the same index; with helpers, a placer that
// may be asked from several threads at once. Threads: safe with a workspace per caller; the same
// bytes always, however many helpers there are. Cost: O(candidate cells).
mesh::TriangleMesh March(const CellIndex& index, const mesh::VertexPlacer& placer,
                         Workspace& workspace);

}  // namespace liquidblend::slice

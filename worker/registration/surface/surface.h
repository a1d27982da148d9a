// A space-time mesh as registration sees it. Internal to worker/registration.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/mesh/space_time_mesh.h"
#include "worker/registration/surface/cell_graph.h"

namespace liquidblend::registration {

// Vertices with the projection on the directions of space in which they stay where they are.
using HeldVertices = absl::flat_hash_map<int32_t, Eigen::Matrix3f>;

// A space-time mesh with data per vertex. The references must outlive it.
struct Surface {
  Surface(const mesh::SpaceTimeMesh& space_time_mesh, double edge_length_m,
          const parallel::Arena& arena);
  const mesh::SpaceTimeMesh& mesh;
  Points points;             // mean edge lengths and frames
  PackedLists cells_around;  // per vertex
  std::vector<char> rigid;   // per vertex: part of a rigid piece, so not of the fit
  std::vector<char> open;    // per vertex, or empty: VerticesOf() an open start (starts.h)
  HeldVertices held;         // at edges of the container (container_edges.h)
  bool IsOpen(int64_t v) const { return !open.empty() && open[v] != 0; }
  std::vector<int32_t> FreeVertices() const;  // the others, ascending
  bool IsThin(int64_t v) const { return !mesh.thin.empty() && mesh.thin[v] != 0; }
  bool InFirstSlab(int64_t v) const { return v < mesh.num_first_vertices; }
  bool InPreRoll(int64_t v) const { return mesh.num_pre_roll > 0 && points(3, v) < 0; }
  bool InLastSlab(int64_t v) const { return v >= points.cols() - mesh.num_last_vertices; }
};

}  // namespace liquidblend::registration

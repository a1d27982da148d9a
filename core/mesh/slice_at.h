// Slices of a space-time mesh for measurements. The server slices with its own, faster code.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "core/mesh/triangle_mesh.h"
#include "core/parallel/arena.h"

namespace liquidblend::mesh {

// Slices the mesh at each of the times (frames, ascending). A slice is the surface that the server
// shows at weight 0, but for the choice of diagonals in polygons of five corners and more.
// Requires: times in [0, num_frames - 1].  Threads: same bytes for any thread count. Cost: O(cells)
// for each 64 slices, and O(n log n) in the size of each slice. Memory: up to 256 bytes for each
// cell, if all slices cut it.
std::vector<TriangleMesh> SliceAt(const SpaceTimeMesh& mesh, std::span<const double> times,
                                  const parallel::Arena& arena);

// The same with the vertices moved to `vertices`, a column each. Those of the end slabs must lie
// outside of [0, num_frames - 1] in time.
std::vector<TriangleMesh> SliceAt(const SpaceTimeMesh& mesh, const Eigen::Matrix4Xf& vertices,
                                  std::span<const double> times, const parallel::Arena& arena);

// A slice with the mesh edges that it was cut from.
struct TracedSlice {
  TriangleMesh surface;
  // Per vertex of the surface the ends of the mesh edge that it lies on, the lower one first.
  std::vector<std::array<int32_t, 2>> edges;
};

// Makes the same slices and calls visit(n, slice) with the n-th of them, from several threads and
// in any order. The slices are not kept.
void VisitSlices(const SpaceTimeMesh& mesh, const Eigen::Matrix4Xf& vertices,
                 std::span<const double> times, const parallel::Arena& arena,
                 const std::function<void(int64_t, TracedSlice)>& visit);

}  // namespace liquidblend::mesh

// Gives each frame's slice the frame's volume. Internal to worker/spacetime.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"

namespace liquidblend::spacetime {

// The hexahedra whose time edges (corners c and c + 4) cross one time, which are its slice.
struct FrameHexahedra {
  double time;                                  // frames
  double volume_m3;                             // that the slice is to have
  std::span<const mesh::Hexahedron> hexahedra;  // closed in space
};

// Moves the vertices, but for rigid pieces, along the spatial part of their normals, each by what
// the frames before and after it need, so that the slices' volumes are right: placed vertices are a
// hundredth of an edge length off on average, to the outside where the surface is convex.
//   frames  ascending in time
// Requires: mesh.normals.  Threads: same bytes for any thread count.
// Cost: O(vertices + hexahedra), four times.
void MatchVolumes(std::span<const FrameHexahedra> frames, const parallel::Arena& arena,
                  mesh::SpaceTimeMesh& mesh);

}  // namespace liquidblend::spacetime

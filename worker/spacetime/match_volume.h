// Volume correction: each part of each frame's slice gets the part's volume in the frame. Internal
// to worker/spacetime.
#pragma once

#include <span>
#include <vector>

#include "core/mesh/components.h"
#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"

namespace liquidblend::spacetime {

// The hexahedra whose time edges (corners c and c + 4) cross one time, which are its slice.
struct FrameHexahedra {
  double time;                                  // frames
  std::vector<mesh::Component> parts;           // of the frame, for the slice to match; metres
  std::span<const mesh::Hexahedron> hexahedra;  // closed in space
};

// Moves the vertices, but for rigid pieces, along their normals in space, each by the correction of
// its part in the frames before and after it, so that the slices' volumes match. Without it placed
// vertices are a hundredth of an edge length off on average, to the outside where the surface is
// convex, and fast parts lose volume: some percent of a drop that falls by four edges a frame.
// Parts of the slice that do not correspond one to one to the frame's (they have merged in only one
// of both) are corrected together.
//   frames  ascending in time
// Requires: mesh.normals.  Threads: same bytes for any thread count.
// Cost: O(vertices + hexahedra), five times; parts of a slice times those of its frame.
void MatchVolumes(std::span<const FrameHexahedra> frames, const parallel::Arena& arena,
                  mesh::SpaceTimeMesh& mesh);

}  // namespace liquidblend::spacetime

// Time links between two frames that share connectivity, wholly or mostly (paper, section 4.1).
// Internal to worker/spacetime.
#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::spacetime {

struct LinkOptions {
  double step_s = 1.0 / 24.0;  // > 0; between the frames
  double edge_length_m = 0.1;  // > 0; e of section 4.1
  double reach_edges = 2.0;    // > 0; links are shorter than this many edges
};

struct FrameLinks {
  std::vector<int32_t> vertex;    // per vertex of the earlier frame: one of the later, or -1
  std::vector<int32_t> triangle;  // per triangle of the earlier frame: that of the later one which
                                  // its links meet, run through alike, or -1; none is met twice
  int64_t num_matched = 0;        // triangles that meet one
  // Triangles of the earlier frame with a corner that moves by a tenth of an edge or more, and
  // those of them that meet one. At rest, triangles of rebuilt frames match as well.
  int64_t num_moving = 0;
  int64_t num_moving_matched = 0;
};

// Frames with the same triangle lists are linked number by number. Otherwise a vertex is linked to
// the one that it comes closest to when both are moved towards each other by the mean of their
// velocities, among those that face the same way; it stays unlinked if the backward link of that
// vertex leads to a vertex too far away along the surface (so that links do not jump between
// sheets). Two vertices share a link only where an edge between them collapsed. A vertex few or
// none of whose triangles match then takes the link that would match most of them. Without
// velocities the nearest vertex counts, and vertex numbers where most triangles are shared.
// Requires: indices in range, finite numbers.  Threads: safe.  Cost: O(vertices).
FrameLinks LinkFrames(const mesh::TriangleMesh& earlier, const mesh::TriangleMesh& later,
                      const LinkOptions& options);

}  // namespace liquidblend::spacetime

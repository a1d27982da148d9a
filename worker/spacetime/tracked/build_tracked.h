// Animation -> SpaceTimeMesh where frames share connectivity, wholly or mostly (paper, sections 4.1
// and 8): the vertices are the frames' own, so slices at frames are the frames.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"
#include "worker/spacetime/tracked/track_links.h"

namespace liquidblend::spacetime {

struct TrackedOptions {
  double reach_edges = 2.0;        // [0.1, 8]; time links are shorter than this many mean edges
  double cone_radius_edges = 3.0;  // [0, 64]; rebuilt parts up to this size become one cone
  double anchor_edges = 2.0;       // [0.5, 16]; spacing of the coarse surface for larger ones
  absl::Status Validate() const;   // names the first field out of range, and its value
};

// Share of the moving triangles that meet one of the next frame, from 8 steps spread over the
// animation; 1 if nothing moves. Surfaces of a tracker have 0.93 and more, surfaces that are
// rebuilt for each frame 0.71 and less; 0.85 separates them.
// Requires, Errors, Threads: as TrackLinks.  Cost: O(vertices of 16 frames).
absl::StatusOr<double> MatchedShare(const mesh::Animation& animation, const TrackedOptions& options,
                                    const parallel::Arena& arena);

// Links between all successive frames, and their shares of matched triangles.
struct TrackedLinks {
  std::vector<FrameLinks> steps;  // steps[k] from frame k to frame k + 1
  double matched_share = 1.0;     // of the moving triangles of all frames: those that meet one
  double lowest_share = 1.0;      // of all triangles of both frames of a single step
  int lowest_step = 0;            // the first one that has it
};

// Requires: frames with indices in range and finite numbers.
// Errors: kInvalidArgument (options, fewer than 2 frames, no triangles at all).
// Threads: safe, same bytes for any thread count.  Cost: O(vertices of all frames).
absl::StatusOr<TrackedLinks> TrackLinks(const mesh::Animation& animation,
                                        const TrackedOptions& options,
                                        const parallel::Arena& arena);

// A wedge for each pair of matched triangles; cones and tetrahedra fill the rest. Frame k's
// vertices, in its order, are followed by those added between it and frame k + 1; the end slabs
// are the first and the last frame, moved by a frame of their velocities.
// Requires: links of this animation; frames closed and oriented, for a closed mesh.
// Errors: kInvalidArgument as above; kResourceExhausted beyond 2^31 vertices.
// Threads: safe, same bytes for any thread count.
absl::StatusOr<mesh::SpaceTimeMesh> BuildTracked(const mesh::Animation& animation,
                                                 const TrackedLinks& links,
                                                 const TrackedOptions& options,
                                                 const parallel::Arena& arena,
                                                 const std::function<void(double)>& progress = {});

}  // namespace liquidblend::spacetime

// Fidelity of a space-time mesh to its animation. Internal to worker/spacetime.
#pragma once

#include "absl/status/status.h"
#include "core/mesh/animation.h"
#include "core/mesh/space_time_mesh.h"
#include "core/mesh/space_time_report.h"
#include "core/parallel/arena.h"

namespace liquidblend::spacetime {

// Options of measuring fidelity.
struct FidelityOptions {
  int max_frames = 16;            // [1, 10000]; measured, spread evenly over the animation
  int max_points = 2000;          // [1, 1000000]; of each surface: every n-th vertex
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Compares slices at the times of frames with these frames: the distances of vertices of each
// surface to the other, the volumes, the numbers of components. A frame without a surface, in the
// animation or in the mesh, counts by its volume and its components alone. Requires:
// options.Validate().ok(), the mesh built from the animation. Threads: same bytes for any thread
// count. Cost: O(cells), and for each measured frame O(n log n) in its size.
mesh::Fidelity MeasureFidelity(const mesh::Animation& animation, const mesh::SpaceTimeMesh& mesh,
                               const FidelityOptions& options, const parallel::Arena& arena);

}  // namespace liquidblend::spacetime

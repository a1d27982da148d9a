// The whole frames at which a space-time mesh is measured.
#pragma once

#include <vector>

#include "core/mesh/space_time_mesh.h"

namespace liquidblend::mesh {

// The largest number of frames that WholeFrames() returns.
inline constexpr int kMostWholeFrames = 4096;

// The whole frames in [0, num_frames - 1] that are less than one frame away from a vertex,
// ascending: all of them unless the animation has long gaps. At most kMostWholeFrames, evenly
// chosen from those, the first and the last among them.
// Cost: O(n log n) in the number of vertices, whatever the duration.
std::vector<double> WholeFrames(const SpaceTimeMesh& mesh);

}  // namespace liquidblend::mesh

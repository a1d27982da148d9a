// Report of a space-time mesh.
#pragma once

#include "core/mesh/animation.h"
#include "core/mesh/space_time_mesh.h"
#include "core/mesh/space_time_report.h"
#include "core/parallel/arena.h"
#include "worker/spacetime/build.h"

namespace liquidblend::spacetime {

// Counts the mesh's elements, and measures its fidelity to the animation at 16 frames.
//   options  options of Build(); connectivity is ChooseConnectivity()'s result
// Requires: options.connectivity is not kAuto.
// Threads: same bytes for any thread count.  Cost: some percent of Build's.
mesh::SpaceTimeReport Report(const mesh::Animation& animation, const mesh::SpaceTimeMesh& mesh,
                             const BuildOptions& options, const parallel::Arena& arena);

}  // namespace liquidblend::spacetime

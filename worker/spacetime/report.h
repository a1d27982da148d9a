// What a space-time mesh became, for those who asked for it.
#pragma once

#include "core/mesh/animation.h"
#include "core/mesh/space_time_mesh.h"
#include "core/mesh/space_time_report.h"
#include "core/parallel/arena.h"
#include "worker/spacetime/build.h"

namespace liquidblend::spacetime {

// Counts what is in the mesh, and measures at 16 frames how well it shows the animation.
//   options  what the mesh was built with; connectivity as ChooseConnectivity() told
// Requires: options.connectivity is not kAuto.
// Threads: same bytes for any thread count.  Cost: some percent of Build's.
mesh::SpaceTimeReport Report(const mesh::Animation& animation, const mesh::SpaceTimeMesh& mesh,
                             const BuildOptions& options, const parallel::Arena& arena);

}  // namespace liquidblend::spacetime

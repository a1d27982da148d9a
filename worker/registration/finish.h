// What is done to the displacements after the last iteration. Internal to worker/registration.
#pragma once

#include "worker/registration/match.h"

namespace liquidblend::registration {

struct ProjectionOptions {
  float max_distance = 3.0f;  // edges; further residuals are not trusted
  float stiffness = 0.3f;     // of a residual against the mean of its neighbours
  int sweeps = 30;
};

// Adds to the displacements the remaining distance to the target along its normals, smoothed over
// the neighbours. Returns the mean distance to the target that was left before, in edges.
double ProjectOntoTarget(const Surface& source, const IndexLists& neighbors,
                         const ClosestPointSearch& target, const ProjectionOptions& options,
                         const parallel::Arena& arena, Points& displacement);

// Moves layers that face against the target next to them a little beneath it. Where the surface
// lies on the target in several layers, every other one faces against it: a liquid of several
// layers shows the outermost, which must face outwards. Returns how many vertices the last of the
// rounds moved.
int64_t TuckTurnedLayers(const Surface& source, const IndexLists& neighbors,
                         const ClosestPointSearch& target, const parallel::Arena& arena,
                         Points& displacement);

// Averages each displacement with its neighbours', `sweeps` times.
Points Smooth(const Points& displacement, const IndexLists& neighbors, int sweeps,
              const parallel::Arena& arena);

}  // namespace liquidblend::registration

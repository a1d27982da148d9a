// Projection and smoothing of the displacements after the last iteration. Internal to
// worker/registration.
#pragma once

#include "worker/registration/surface/closest_point.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

struct ProjectionOptions {
  float max_distance = 3.0f;  // edges; further residuals are not trusted
  float stiffness = 0.3f;     // of a residual against the mean of its neighbours
  int sweeps = 30;
  int stride = 1;  // of the vertices whose residuals are measured; the others follow
};

// Adds to the displacements the remaining distance to the target along its normals, smoothed over
// the neighbours. Returns the mean distance to the target that was left before, in edges.
double ProjectOntoTarget(const Surface& source, const PackedLists& neighbors, const Surface& target,
                         const ClosestPointSearch& target_search, const ProjectionOptions& options,
                         const parallel::Arena& arena, Points& displacement);

// Averages each displacement with its neighbours', `sweeps` times.
Points Smooth(const Points& displacement, const PackedLists& neighbors, int sweeps,
              const parallel::Arena& arena);

}  // namespace liquidblend::registration

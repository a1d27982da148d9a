// Initial state of a refinement (paper, section 6.3, last paragraph). Internal to
// worker/registration.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/energy.h"
#include "worker/registration/fit/pins.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Maps whose blend approximates a displacement of the vertices: for each node an affine
// least-squares fit over the vertices closer than `radius` to it.
// Threads: same bytes for any thread count.
std::vector<NodeMap> FitMaps(const DeformationNodes& nodes, const Points& rest,
                             const PackedLists& neighbors, const Points& displacement,
                             double radius, const parallel::Arena& arena);

// The pins of all correspondences that are in only one of the lists: added, removed, changed.
// Errors: those of ExpandCorrespondences().
absl::StatusOr<std::vector<Pin>> ChangedPins(const std::vector<Correspondence>& before,
                                             const std::vector<Correspondence>& now,
                                             const Surface& source, const Surface& target,
                                             const parallel::Arena& arena);

// Per node 1 next to one of the pins, falling to 0 at `radius` from the nearest of them.
std::vector<float> ClosenessToPins(const DeformationNodes& nodes, const Points& rest,
                                   const std::vector<Pin>& pins, double radius);

}  // namespace liquidblend::registration

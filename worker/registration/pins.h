// User correspondences as fitting terms (paper, section 6). Internal to worker/registration.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "worker/registration/correspondence.h"
#include "worker/registration/match.h"

namespace liquidblend::registration {

// A source vertex that is to go to a place in registration units.
struct Pin {
  int32_t vertex;
  Eigen::Vector4f goal;  // displacement
  bool hard;
  bool in_time;  // false: free to slide in time
};

// One pin per point; per trajectory one every 10 frames, followed through the velocity fields of
// both meshes; per space correspondence one every 10 frames at a fixed place.
// Errors: kInvalidArgument naming the correspondence (from 0) whose points lie outside of the
// animations in time, are not finite, or need velocities that a mesh does not have.
absl::StatusOr<std::vector<Pin>> ExpandCorrespondences(
    const std::vector<Correspondence>& correspondences, const Surface& source,
    const Surface& target);

FitTerm TermOf(const Pin& pin, double weight);

}  // namespace liquidblend::registration

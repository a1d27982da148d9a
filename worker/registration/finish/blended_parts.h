// Detached parts of blends, compared with those of both animations. Internal to
// worker/registration.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "worker/registration/features/pair_features.h"
#include "worker/registration/features/tracks.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// One part that is detached in the first frames of both animations.
struct PartOfBoth {
  Track source, target;
};

// The parts of paired tracks that begin at the first frame and live for some frames in both.
std::vector<PartOfBoth> PartsOfBoth(const Features& source, const Features& target,
                                    const std::vector<AssignedPair>& pairs);

// How far a blend's part is from what lies between both animations' parts.
struct PartError {
  double value = 0.0;                               // the largest
  Eigen::Vector4d place = Eigen::Vector4d::Zero();  // where it should be; registration units
};

struct PartErrors {
  // Distance of the part's centre from the point between both animations' centres, in diameters; 1
  // also if there is no detached part of like volume.
  PartError shift;
  PartError volume;  // as a share
  // Error of the acceleration of free fall, as a share of that in both animations.
  PartError fall;
};

// Compares at weights 0.25, 0.5 and 0.75, at some times of the parts' lives. A part should have
// lived for the same share of its life as in both animations, and its volume should lie between
// that of the mean diameter and the mean volume.
//   displacement  a column per source vertex, registration units
// Threads: same bytes for any thread count.  Cost: O(cells) and some slices, for each weight.
PartErrors CompareParts(const Surface& source, const Points& displacement,
                        const std::vector<PartOfBoth>& parts, const parallel::Arena& arena);

}  // namespace liquidblend::registration

// Rest: whether the detached parts of the first frames fall from rest, and since when. The squares
// of the times of such falls blend linearly where the heights do (docs/time-blending.md). Internal
// to worker/registration.
#pragma once

#include "core/mesh/registered_family.h"
#include "worker/registration/features/pair_features.h"

namespace liquidblend::registration {

inline constexpr double kSameRestFrames = 1.5;  // rest times that differ less are the same

struct RestOptions {
  double min_fall = 1.0;         // > 0; edges; parts that move less stay where they are
  double max_error = 0.03;       // >= 0; RMS distance from a parabola, as a share of the fall ...
  double max_error_edges = 0.2;  // >= 0; ... and in edges beside it
  double max_drift = 0.1;        // >= 0; sideways, as a share of the fall ...
  double max_drift_edges = 1.0;  // >= 0; ... and in edges beside it
  double max_gravity_ratio = 1.25;     // >= 1; between any two parts ...
  double min_bend = 1.0;               // ... that bend by this much; edges; of others it is unknown
  double max_age = 4.0;                // > 0; of the rest, in times of the course that is seen
  double tolerance = kSameRestFrames;  // >= 0; frames; between any two parts, and of the first one
};

// Finds out whether all parts that are detached in the first frame of either animation and move
// from there fall from rest, since the same time and equally fast, and whether both have one. The
// time is 0 if it is the first frame within the tolerance. The reason names what speaks against it.
//   joined  tracks that have no partner
mesh::RestReport FindRest(const Features& source, const Features& target,
                          const JoinedTracks& joined = {}, const RestOptions& options = {});

}  // namespace liquidblend::registration

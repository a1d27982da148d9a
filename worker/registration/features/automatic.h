// Automatic correspondences (paper, section 10), from features of space-time that both animations
// have. Internal to worker/registration.
#pragma once

#include <vector>

#include "worker/registration/features/pair_features.h"
#include "worker/registration/surface/correspondence.h"

namespace liquidblend::registration {

struct AutomaticCorrespondence {
  Correspondence correspondence;  // soft
  double confidence = 0.0;        // (0, 1]; of the pair of features that it comes from
};

// Finds the features of one animation.
Features FindFeatures(const Surface& surface, const TrackOptions& options = {});

struct FeaturesOfPair {
  Features source, target;
};

// Finds only tracks, their vertices and lumps.
Features FindTrackFeatures(const Surface& surface, const TrackOptions& options = {});

// Threads: same bytes for any thread count.
FeaturesOfPair FindFeatures(const Surface& source, const Surface& target,
                            const TrackOptions& options, const parallel::Arena& arena);

// Correspondences from pairs of features. As points: a detached part gives its furthest points up
// and down, left and right, to the front and back at its start, and if its life is more than 10
// frames longer in one of the two, every 10 frames until it ends; an extremum gives itself; the
// wake of a detached part that strikes elsewhere gives a point at each time at which it is found
// (wakes.h). As spaces: an obstacle of another place or size gives some of its contacts. A pair of
// features gives none if one of its points lies within 10 mean edges (a frame counts as one; for
// spaces it does not) of one of the user's; nor does the wake of such a part.
// Requires: both surfaces are in units of edge_length_m.
//   pairs  of those features
std::vector<AutomaticCorrespondence> FindAutomatic(const Surface& source, const Surface& target,
                                                   const FeaturesOfPair& features,
                                                   const FeaturePairs& pairs,
                                                   const std::vector<Correspondence>& users,
                                                   double edge_length_m,
                                                   const parallel::Arena& arena);

}  // namespace liquidblend::registration

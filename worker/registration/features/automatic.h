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

// Correspondences from pairs of features:
//   detached part  its six outermost points along the axes, where it starts; if its life is more
//                  than 10 frames longer in one of the two, also every 10 frames until it ends
//   extremum       itself
//   wake           of a detached part that strikes elsewhere: a point at each time at which it is
//                  found (wakes.h)
//   obstacle       of another place or size: some of its contacts, as spaces
// A pair gives none if one of its points lies within 10 mean edges of one of the user's; nor does
// the wake of such a part. A frame counts as a mean edge; for spaces, time does not count.
// Requires: both surfaces are in units of edge_length_m.
//   pairs  of those features
std::vector<AutomaticCorrespondence> FindAutomatic(const Surface& source, const Surface& target,
                                                   const FeaturesOfPair& features,
                                                   const FeaturePairs& pairs,
                                                   const std::vector<Correspondence>& users,
                                                   double edge_length_m,
                                                   const parallel::Arena& arena);

}  // namespace liquidblend::registration

// How far a registered source and its target are from one another. Internal to worker/registration.
#pragma once

#include <limits>
#include <vector>

#include "worker/registration/surface/closest_point.h"
#include "worker/registration/surface/regions.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

inline constexpr float kReachEdges = 1.0f;  // a counterpart this close is one

// A vertex and how far it is from the other animation; kNoCounterpart: nothing near by faces the
// same way, or there is nothing near by at all.
inline constexpr float kNoCounterpart = std::numeric_limits<float>::infinity();
struct Sample {
  Eigen::Vector4f position;  // registration units
  float distance;            // edges
};

// Vertices of the source that are not of end slabs or rigid pieces nor came to lie before the
// target's first frame as they should (starts.h), some 20,000, as moved, with
// their distances to the target.  Threads: same bytes for any thread count.
std::vector<Sample> SampleSource(const Surface& source, const Points& moved, const Surface& target,
                                 const ClosestPointSearch& target_search,
                                 const parallel::Arena& arena);

// The same of the target, with its distances to the moved source: to tangent planes next to the
// source's vertices.
std::vector<Sample> SampleTarget(const Surface& source, const Points& moved, const Surface& target,
                                 const parallel::Arena& arena);

// Share of the samples with distances in [from, to).
double ShareBetween(const std::vector<Sample>& samples, double from, double to);

// The largest share, over twelfths of the animation, of samples without a counterpart within reach.
double LargestUnmatchedShare(const std::vector<Sample>& samples, int num_frames);

// Adds the samples by their distances, up to 8 edges.
void AddDistances(const std::vector<Sample>& samples, Regions& regions);

// The mean change of the distances between neighbours, as a share of them; adds it to the regions.
double MeanStretch(const Surface& source, const PackedLists& neighbors, const Points& moved,
                   const parallel::Arena& arena, Regions& regions);

}  // namespace liquidblend::registration

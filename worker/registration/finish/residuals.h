// Residuals: distances between a registered source and its target. Internal to worker/registration.
#pragma once

#include <limits>
#include <vector>

#include "worker/registration/surface/closest_point.h"
#include "worker/registration/surface/regions.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

inline constexpr float kReachEdges = 1.0f;  // largest distance of a counterpart

// A vertex and its distance from the other animation; kNoCounterpart if no surface near by faces
// the same way.
inline constexpr float kNoCounterpart = std::numeric_limits<float>::infinity();
struct Sample {
  Eigen::Vector4f position;  // registration units
  float distance;            // edges
};

// Samples some 20,000 moved vertices of the source, with their distances to the target. Left out
// are vertices of end slabs and rigid pieces, and those of open starts and of the pre-roll before
// the target's first frame (starts.h, pre_roll.h).  Threads: same bytes for any thread count.
std::vector<Sample> SampleSource(const Surface& source, const Points& moved, const Surface& target,
                                 const ClosestPointSearch& target_search,
                                 const parallel::Arena& arena);

// Samples the target's vertices, with their distances to the moved source, measured to tangent
// planes at the source's vertices.
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

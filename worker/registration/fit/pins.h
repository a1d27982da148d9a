// Pins: correspondences as source vertices with goals (paper, section 6). Internal to
// worker/registration.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "worker/registration/fit/energy.h"
#include "worker/registration/surface/correspondence.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// A source vertex and its goal, in registration units.
struct Pin {
  int32_t vertex;
  Eigen::Vector4f goal;  // displacement
  bool hard;
  bool in_time;            // false: free to slide in time
  int32_t correspondence;  // index of its correspondence
};

inline constexpr float kOnSurfaceEdges = 5.0f;  // points further from the surface have no vertex

// One pin per point; per trajectory one every 10 frames, followed through the velocity fields of
// both meshes until it leaves one of the surfaces; per space correspondence one every 10 frames at
// a fixed place, where the source's surface is there. In the order of the correspondences. Errors:
// kInvalidArgument naming the correspondence (from 0) whose points lie outside of the animations in
// time, further off their surfaces than `on_surface`, are not finite, or need velocities that a
// mesh does not have.
absl::StatusOr<std::vector<Pin>> ExpandCorrespondences(
    const std::vector<Correspondence>& correspondences, const Surface& source,
    const Surface& target, const parallel::Arena& arena, float on_surface = kOnSurfaceEdges);

// Replaces the closest points of the vertices of soft correspondences. Each weighs as much as
// `weight` matches of an average node, however many terms there are.
void OverrideClosestPoints(const std::vector<Pin>& pins, double weight, int64_t num_nodes,
                           std::vector<FitTerm>& terms);

// Reports how the result meets each correspondence. A soft one is overruled if a node of it is
// further than 3 edges (frames in time) from where it should be.
//   displacement  in registration units
std::vector<CorrespondenceReport> ReportCorrespondences(
    const std::vector<Correspondence>& correspondences, const std::vector<Pin>& pins,
    const Points& displacement, double edge_length_m);

}  // namespace liquidblend::registration

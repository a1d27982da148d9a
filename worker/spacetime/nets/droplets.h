// Droplets: small parts of the liquid, followed from frame to frame (paper, section 5.3). Internal
// to worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/mesh/animation.h"

namespace liquidblend::spacetime {

// A component of one frame: a drop, or a bubble (of negative volume).
struct Droplet {
  int frame = 0;
  mesh::TriangleMesh shape;  // around its centroid, metres
  Eigen::Vector3d centroid_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();
  double volume_m3 = 0.0;
  double radius_m = 0.0;  // of the furthest vertex
};

// One droplet over its life. `birth` is before its first frame, `death` after its last: half-way to
// the next frame where droplets split or merge, close to the other frame where it leaves or joins
// the rest of the liquid. Frames since the first.
struct DropletTrack {
  std::vector<Droplet> droplets;  // one per frame, in consecutive frames
  double birth = 0.0, death = 0.0;
};

struct DropletSplit {
  std::vector<DropletTrack> tracks;     // in the order of their first frames
  std::optional<mesh::Animation> rest;  // the animation without them; none: there are no droplets
};

// Splits off the components with a surface of less than max_area_m2.
// Cost: O(triangles), and droplets squared per frame.
DropletSplit SplitDroplets(const mesh::Animation& animation, double max_area_m2);

}  // namespace liquidblend::spacetime

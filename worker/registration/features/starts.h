// Open starts: parts of the liquid that are apart in the first frame of one animation and joined
// with the rest in the other's. Examples are a drop that is bridged to the pool there, or that has
// struck before the first frame. Internal to worker/registration.
#pragma once

#include <string>
#include <vector>

#include "worker/registration/features/pair_features.h"

namespace liquidblend::registration {

// Tracks from the first frame on that have no counterpart. Registration units.
struct OpenStarts {
  std::vector<Track> source, target;
  bool empty() const { return source.empty() && target.empty(); }
};

// Finds the open starts: the tracks whose lumps are joined with the rest in the other animation,
// and not cut off in its pre-roll. Of the others, those of the animation that has more of them,
// without those that pair best.
OpenStarts FindOpenStarts(const Features& source, const Features& target, const SceneScale& scale);

// Flags the source's vertices that an open start of the source concerns (Surface::open): of the
// part while it is apart, of its surroundings and of the surface that it strikes. Empty if there
// are none. Open starts of the target need no flags: closest points let the source's surface follow
// them.
std::vector<char> VerticesOf(const OpenStarts& starts, const Surface& source);

// A sentence with place and time of each; empty if there are none.
std::string Describe(const OpenStarts& starts, double edge_length_m);

}  // namespace liquidblend::registration

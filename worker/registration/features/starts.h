// Parts of the liquid that are apart in the first frame of one animation and one with the rest in
// the other's: a drop that is bridged to the pool there, or that has struck before it begins.
// Internal to worker/registration.
#pragma once

#include <string>
#include <vector>

#include "worker/registration/features/tracks.h"

namespace liquidblend::registration {

// Tracks from the first frame on that have no counterpart. Registration units.
struct OpenStarts {
  std::vector<Track> source, target;
  bool empty() const { return source.empty() && target.empty(); }
};

// Those of the animation that has more of them, but for the ones that pair best. As many on both
// sides: none, whatever they look like.
OpenStarts FindOpenStarts(const std::vector<Track>& source, const std::vector<Track>& target,
                          const Surface& source_surface, const Surface& target_surface);

// The source's vertices that such a start of its own concerns (Surface::open): of the part while it
// is apart, of what surrounds it and of what it strikes. Empty if there are none. A part of the
// target's is found by closest points: what the source has there can follow it, neck and all.
std::vector<char> VerticesOf(const OpenStarts& starts, const Surface& source);

// A sentence with place and time of each; empty if there are none.
std::string Describe(const OpenStarts& starts, double edge_length_m);

}  // namespace liquidblend::registration

// Free fall: the parabola that a detached part follows. Internal to worker/registration.
#pragma once

#include <optional>

#include "worker/registration/features/tracks.h"

namespace liquidblend::registration {

// The parabola closest to the heights of a part's centre, with how well it describes the part's
// course. Registration units.
struct FreeFall {
  double acceleration = 0.0;  // downwards; edges per frame squared
  double peak_time = 0.0;     // when the part is or would be at rest; of no use at a steady speed
  double frames = 0.0;        // from the first slab to the last one
  double fallen = 0.0;        // between these; below 0 if it has risen
  double drift = 0.0;         // sideways between these
  double error = 0.0;         // RMS distance of the heights from the parabola
  double moved() const;       // between the first slab and the last one
  // Height of the parabola above its chord: what tells it from a steady speed.
  double bend() const { return acceleration * frames * frames / 8; }
  // Whether the part falls freely, as far as its course tells.
  bool is_free() const;
};

// The fit over the track's life but for its last frame, in which it may be one with the rest.
// Nothing if there are fewer than four slabs.
std::optional<FreeFall> FitFreeFall(const Track& track, mesh::Up up);

}  // namespace liquidblend::registration

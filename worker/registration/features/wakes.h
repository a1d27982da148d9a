// Wakes: the crater, the jet and the waves that a part of the liquid leaves on the surface that it
// strikes. Closest points find a surface near by everywhere on a pool, so they leave a crater where
// it is, though the drop that makes it strikes elsewhere. Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/parallel/arena.h"
#include "worker/registration/features/pair_features.h"

namespace liquidblend::registration {

// A point in both animations; registration units.
struct EventPair {
  Eigen::Vector4d source, target;
};

// The wake of a pair of tracks, as far as it is alike in both animations.
struct Wake {
  int pair = 0;                   // index of the pair
  std::vector<EventPair> points;  // ascending in time
};

struct WakeOptions {
  double min_shift = 3.0;     // >= 0; edges sideways; closest points follow a shorter one
  int num_times = 10;         // >= 1; at which the wake is looked for once the part has gone in
  double time_step = 0.375;   // > 0; from the strike to the first one, and from one to the next; in
                              // times that a crater takes, sqrt(diameter / gravity)
  double radius = 1.25;       // > 0; of what is compared, in diameters of the part
  double search = 0.25;       // >= 0; furthest from where it is expected, likewise
  double min_relief = 2.0;    // > 0; edges: flatter wakes say nothing
  double max_residual = 0.3;  // (0, 1]; of the target's variance that is left over ...
  double min_gain = 2.0;      // >= 1; ... and how many times more it must be without the shift
  double max_factor = 3.0;    // >= 1; between the reliefs
  size_t min_points = 3;      // >= 1; a wake found at fewer times is none
};

// Finds the wakes of paired tracks that end by merges at places apart. At each time after the
// strike the source's heights around its place are looked for among the target's heights, at the
// same time after the strike there. Where they are found, and explain the target much better than
// the same heights left where they are, the middle of what is furthest from the patch's median
// height (bottom of a crater, tip of a jet) becomes a pair of points.
//   from, to       features of the two
//   edge_length_m  the unit of length of both surfaces
// Threads: same bytes for any thread count.  Cost: O(cells) for each wake, and 2 num_times slices.
std::vector<Wake> FindWakes(const Surface& source, const Surface& target, const Features& from,
                            const Features& to, const std::vector<AssignedPair>& tracks,
                            double edge_length_m, const parallel::Arena& arena,
                            const WakeOptions& options = {});

}  // namespace liquidblend::registration

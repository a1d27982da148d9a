// Relief of a blend: how far craters, jets and waves stand out of the surface around them. Where
// two animations have them at different places and nothing carries them from one to the other, a
// blend has both, each half as high. Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "core/mesh/up.h"
#include "core/parallel/arena.h"

namespace liquidblend::registration {

// Slices of a blend.
struct BlendSlices {
  double weight = 0.5;  // [0, 1]
  std::vector<mesh::TriangleMesh> slices;
};

// How much of the relief is lost.
struct ReliefLoss {
  // 1 - the blend's relief over the mean of both animations' with its weight; 0 if it is not lower,
  // or if they have none. Two craters in place of one, half-way: 1 - sqrt(1/2).
  double share = 0.0;
  int slice = 0;  // where most is lost
  // Centres of the relief there, metres: of the source, of the target.
  Eigen::Vector3d source_m = Eigen::Vector3d::Zero(), target_m = Eigen::Vector3d::Zero();
};

// The relief of an animation is the root mean square, over all slices, of the heights seen from
// above less the slice's median. So events may come at other times. Of parts that are apart, only
// those with a quarter of the liquid or more are seen: drops are not.
// Where there is no liquid, the lowest height of either animation counts. An edge along the box
// around both is left out.
//   source, target, blends  slices at the same times, metres; as many of each
//   up                      of all of them
//   edge_length_m           > 0; mean edge length
// Returns the loss of the blend that loses most.
// Threads: same bytes for any thread count.  Cost: O(triangles + grid points).
ReliefLoss LossOfRelief(const std::vector<mesh::TriangleMesh>& source,
                        const std::vector<mesh::TriangleMesh>& target,
                        const std::vector<BlendSlices>& blends, mesh::Up up, double edge_length_m,
                        const parallel::Arena& arena);

}  // namespace liquidblend::registration

// Verdict on a finished registration. Internal to worker/registration.
#pragma once

#include <Eigen/Core>

#include "core/mesh/verdict.h"
#include "worker/registration/features/part_motions.h"
#include "worker/registration/finish/blended_parts.h"
#include "worker/registration/surface/closest_point.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Computes all figures but the energies. The moved source is compared with the target at samples of
// both, and the blends at weights 0.25, 0.5, 0.75 and 1 are sliced at some times.
//   displacement  final, a column per source vertex, registration units, finite
//   parts         that are detached in both
//   times         where they blend as squares, falls are not compared: there they are right
// Threads: same bytes for any thread count.  Cost: some hundredths of the registration's.
mesh::Verdict Judge(const Surface& source, const PackedLists& neighbors, const Surface& target,
                    const ClosestPointSearch& target_search, const Points& displacement,
                    const std::vector<PartOfBoth>& parts, const PartMotions& motions,
                    TimesBlend times, const parallel::Arena& arena);

// Cost of the blends: the sum over the verdict's figures of (value / limit of "good")^2. Infinity
// if a figure is no number.
double CostOf(const mesh::Verdict& verdict);

// Places where each kind of figure is worst: x, y, z in metres, time in frames.
struct WorstPlaces {
  Eigen::Vector4d unmatched = Eigen::Vector4d::Zero();
  Eigen::Vector4d inverted = Eigen::Vector4d::Zero();
  Eigen::Vector4d volume = Eigen::Vector4d::Zero();
  Eigen::Vector4d stretched = Eigen::Vector4d::Zero();
  Eigen::Vector4d shifted_part = Eigen::Vector4d::Zero();
  Eigen::Vector4d part_of_other_volume = Eigen::Vector4d::Zero();
  Eigen::Vector4d falling_part = Eigen::Vector4d::Zero();
  Eigen::Vector4d relief = Eigen::Vector4d::Zero();            // the source's ...
  Eigen::Vector3d relief_of_target = Eigen::Vector3d::Zero();  // ... and the target's at that time
};

// Sets grade, reason and worst place: those of the figure that is furthest over its limit, or
// closest to it, unless the sum of all figures gives a worse grade. The limits are calibrated on
// simulations, good pairs and absurd ones (docs/experiments/verdicts.md).
void SetGrade(const WorstPlaces& places, mesh::Verdict& verdict);

}  // namespace liquidblend::registration

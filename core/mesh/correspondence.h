// Correspondences of two animations (paper, section 6), given by a user or found by the
// registration, and reports of how a registration met them.
#pragma once

#include <Eigen/Core>

namespace liquidblend::mesh {

// Kind of a correspondence: which points belong together, and for how long.
enum class CorrespondenceKind {
  kPoint,       // one point in space-time onto another
  kTrajectory,  // a feature onto a feature for a while, followed through the velocity fields
  kSpace,       // pinned in x, y, z, free to slide in time
};

// One correspondence. Points are x, y, z in metres and time in frames.
struct Correspondence {
  CorrespondenceKind kind = CorrespondenceKind::kPoint;
  bool hard = false;  // hard: held to the end; soft: released when the fit is good
  Eigen::Vector4d source = Eigen::Vector4d::Zero();
  Eigen::Vector4d target = Eigen::Vector4d::Zero();
  double length_frames = 0.0;  // kTrajectory, kSpace: how long; 0: to the end
  bool operator==(const Correspondence&) const = default;
};

// Report of how a registration met one correspondence. The residual is the largest over the
// deformation nodes that represent it; time does not count for kSpace.
struct CorrespondenceReport {
  Correspondence correspondence;
  bool automatic = false;   // found by the registration, not given by a user
  double confidence = 1.0;  // [0, 1]; of an automatic one
  int num_nodes = 0;
  double residual_m = 0.0;
  double residual_frames = 0.0;
  bool kept = true;  // false: soft, and the rest of the surface overruled it
};

}  // namespace liquidblend::mesh

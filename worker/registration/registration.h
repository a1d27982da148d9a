// Options and result of a registration.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/registration_options.h"
#include "worker/registration/surface/correspondence.h"

namespace liquidblend::registration {

// Which pairs of features guide a registration.
enum class Pairing {
  kFound,      // those of least cost
  kExchanged,  // two parts that are detached in the first frames exchange their partners
  kNone,       // neither points nor motions of paired features
};

// Options of a registration: those of users, and further ones that tests set. Lengths are in mean
// edge lengths of the source; a frame of time counts as one.
struct RegistrationOptions : mesh::RegistrationOptions {
  double kept_share = 0.2;              // [0, 1]; of the samples: the worst of the iteration before
  double first_smoothness = 500.0;      // > 0; lambda of the first iteration, falls geometrically
  double first_distance_edges = 37.0;   // > 0; matches beyond this are ignored at first ...
  double final_distance_edges = 14.0;   // > 0; ... and beyond this at last
  double point_weight = 0.1;            // >= 0; gamma_point, equation (5)
  double plane_weight = 1.0;            // >= 0; gamma_plane, equation (5)
  double correspondence_weight = 20.0;  // >= 0; of a soft one, in matches of an average node
  double soft_release = 0.5;            // [0, 1]; share of the iterations that soft ones last
  double smallest_part_edges = 4.0;     // >= 0; in diameter; smaller parts are not paired
  int max_direct_rows = 400;            // larger systems by conjugate gradients (section 6.3)
  // >= 1e3; approximate size of the coarse mesh that a larger one is registered on first. Smaller
  // if layers between frames make up most of the large mesh: the coarse one needs none.
  double coarse_vertices = 6e5;
  double finer_from_edges = 1.0;      // > 0; regions further off than this get nodes of their own
  Pairing pairing = Pairing::kFound;  // tried first, where correspondences are automatic
  // Whether features that are paired in this way guide the registration.
  bool IsGuidedBy(Pairing pairs) const {
    return automatic_correspondences && pairs != Pairing::kNone;
  }
  // Spacing of nodes on a mesh whose edges are `scale` times as short.
  double NodeSpacing(double scale = 1.0) const { return node_spacing_edges * scale; }
  // Factor of a smoothness that is annealed from `first`, after a share of the annealing.
  double SmoothnessFactor(double first, double share) const {
    return std::pow(final_smoothness / first, share);
  }
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Result of a registration.
struct Registration {
  Eigen::Matrix4Xf displacement;   // one column per source vertex: m, m, m, frames
  Eigen::Matrix4Xf extrapolation;  // smoothed displacement for weights outside [0, 1]
  mesh::RegistrationReport report;
};

// Registration that Refine() starts from; the references must outlive the call.
struct PreviousRegistration {
  const Eigen::Matrix4Xf& displacement;                // as in Registration
  const std::vector<Correspondence>& correspondences;  // that it was made with
  std::vector<mesh::Hypothesis> hypotheses = {};       // of its report
};

}  // namespace liquidblend::registration

// What a registration is asked with, and its result.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/registered_family.h"
#include "worker/registration/surface/correspondence.h"

namespace liquidblend::registration {

// Lengths are in mean edge lengths of the source; a frame of time counts as one.
struct RegistrationOptions {
  int max_iterations = 16;             // [1, 200]
  double node_spacing_edges = 5.0;     // [1, 100]; distance between deformation nodes
  double sample_share = 0.1;           // (0, 1]; vertices sampled in each iteration (section 6.2)
  double kept_share = 0.2;             // [0, 1]; of the samples: the worst of the iteration before
  double first_smoothness = 500.0;     // > 0; lambda of the first iteration ...
  double final_smoothness = 0.06;      // > 0; ... falls geometrically to this
  double first_distance_edges = 37.0;  // > 0; matches beyond this are ignored at first ...
  double final_distance_edges = 14.0;  // > 0; ... and beyond this at last
  double thin_sheets_from = 0.0;  // [0, 1]; share of the iterations before thin sheets join the
                                  // fit; 1: never (section 5.3)
  double point_weight = 0.1;      // >= 0; gamma_point, equation (5)
  double plane_weight = 1.0;      // >= 0; gamma_plane, equation (5)
  double correspondence_weight = 20.0;    // >= 0; of a soft one, in matches of an average node
  double soft_release = 0.5;              // [0, 1]; share of the iterations that soft ones last
  bool automatic_correspondences = true;  // soft ones of what stands out in both, after the user's
  double smallest_part_edges = 4.0;       // >= 0; in diameter: smaller ones tell nothing of it
  int refine_iterations = 6;              // [1, 200]; of Refine() instead of max_iterations
  int max_direct_rows = 400;              // larger systems by conjugate gradients (section 6.3)
  // >= 1e3; of the meshes that larger ones begin with, about. Fewer where layers between frames
  // make up most of the large mesh: the coarse one needs none.
  double coarse_vertices = 6e5;
  double finer_from_edges = 1.0;  // > 0; what is further off after that gets nodes of its own
  uint64_t seed = 1;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

struct Registration {
  Eigen::Matrix4Xf displacement;   // one column per source vertex: m, m, m, frames
  Eigen::Matrix4Xf extrapolation;  // smoothed displacement for weights outside [0, 1]
  mesh::RegistrationReport report;
};

// What Refine() goes on from; the references must outlive the call.
struct PreviousRegistration {
  const Eigen::Matrix4Xf& displacement;                // as in Registration
  const std::vector<Correspondence>& correspondences;  // that it was made with
};

}  // namespace liquidblend::registration

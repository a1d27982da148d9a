// Non-rigid ICP in space-time: moves the source's space-time mesh onto the target's (paper,
// sections 5 and 6).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"
#include "worker/registration/correspondence.h"
#include "worker/registration/state.h"

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

// Hard correspondences hold exactly in the result. The report has one entry per correspondence,
// then the automatic ones.
// Requires: both meshes have normals and passed Validate().
// Errors: kInvalidArgument (options; frame rates differ; a mesh without cells; a correspondence off
// the surfaces; two hard ones that contradict each other), kCancelled, kInternal if the solver
// breaks down (names the iteration), kFailedPrecondition (RegistrationHooks::resume).
// Threads: safe, same bytes for any thread count and a given seed.
absl::StatusOr<Registration> Register(const mesh::SpaceTimeMesh& source,
                                      const mesh::SpaceTimeMesh& target,
                                      const std::vector<Correspondence>& correspondences,
                                      const RegistrationOptions& options,
                                      const parallel::Arena& arena,
                                      const RegistrationHooks& hooks = {});

// The same from an earlier registration of the same meshes on, with other correspondences: only the
// late part of the annealing, stiffer where correspondences were added, removed or changed.
// Errors: also kInvalidArgument if the displacement is not one of this source, or not finite.
absl::StatusOr<Registration> Refine(const mesh::SpaceTimeMesh& source,
                                    const mesh::SpaceTimeMesh& target,
                                    const std::vector<Correspondence>& correspondences,
                                    const PreviousRegistration& previous,
                                    const RegistrationOptions& options,
                                    const parallel::Arena& arena,
                                    const RegistrationHooks& hooks = {});

// Coarse to fine: how many times longer the edges of the meshes should be that a registration of so
// many vertices begins with; 1: it is small enough to be registered at once.
double CoarseScale(int64_t num_vertices, const RegistrationOptions& options);

// For the registration of these coarser meshes: parts of few of their edges are found, and what
// holds them does so for longer, because few nodes and samples are left to each.
RegistrationOptions CoarseOptions(double scale, RegistrationOptions options);

// A registration of coarser meshes of the same animations; the references must outlive the call.
struct CoarseRegistration {
  const mesh::SpaceTimeMesh& source;
  const Registration& registration;
};

// Carries it over to these meshes and fits them to one another, with nodes of their own only where
// that leaves them apart (finer_from_edges).
// Errors: as Register(); also kInvalidArgument if the registration is not one of its source.
// Cost: O(vertices log vertices).
absl::StatusOr<Registration> Sharpen(const mesh::SpaceTimeMesh& source,
                                     const mesh::SpaceTimeMesh& target,
                                     const std::vector<Correspondence>& correspondences,
                                     const CoarseRegistration& coarse,
                                     const RegistrationOptions& options,
                                     const parallel::Arena& arena,
                                     const RegistrationHooks& hooks = {});

// Goes on with that, without the coarse meshes. Errors: also kFailedPrecondition if the state is
// not one of this source.
absl::StatusOr<Registration> ResumeSharpening(const mesh::SpaceTimeMesh& source,
                                              const mesh::SpaceTimeMesh& target,
                                              const std::vector<Correspondence>& correspondences,
                                              const SharpenState& state,
                                              const RegistrationOptions& options,
                                              const parallel::Arena& arena,
                                              const RegistrationHooks& hooks = {});

}  // namespace liquidblend::registration

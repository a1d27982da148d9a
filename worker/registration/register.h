// Non-rigid ICP in space-time: moves the source's space-time mesh onto the target's (paper,
// sections 5 and 6).
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"
#include "worker/registration/fit/state.h"
#include "worker/registration/registration.h"
#include "worker/registration/surface/correspondence.h"

namespace liquidblend::registration {

// Registers the source to the target. Hard correspondences hold exactly in the result. The report
// has one entry per correspondence, then the automatic ones.
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

// Refines an earlier registration of the same meshes, with other correspondences: only the late
// part of the annealing, stiffer where correspondences were added, removed or changed.
// Errors: also kInvalidArgument if the displacement is not one of this source, or not finite.
absl::StatusOr<Registration> Refine(const mesh::SpaceTimeMesh& source,
                                    const mesh::SpaceTimeMesh& target,
                                    const std::vector<Correspondence>& correspondences,
                                    const PreviousRegistration& previous,
                                    const RegistrationOptions& options,
                                    const parallel::Arena& arena,
                                    const RegistrationHooks& hooks = {});

// Coarse to fine: the factor by which the edges of the first, coarse meshes are longer, for a
// registration of so many vertices; 1 if it is small enough to be registered at once.
double CoarseScale(int64_t num_vertices, const RegistrationOptions& options);

// Options for the registration of the coarser meshes: smaller parts are found, and soft constraints
// last longer, because each part has few nodes and samples.
RegistrationOptions CoarseOptions(double scale, RegistrationOptions options);

// A registration of coarser meshes of the same animations; the references must outlive the call.
struct CoarseRegistration {
  const mesh::SpaceTimeMesh& source;
  const Registration& registration;
};

// Carries a coarse registration over to these meshes and fits them to one another, with finer nodes
// only where they stay apart (finer_from_edges).
// Errors: as Register(); also kInvalidArgument if the registration is not one of its source.
// Cost: O(vertices log vertices).
absl::StatusOr<Registration> Sharpen(const mesh::SpaceTimeMesh& source,
                                     const mesh::SpaceTimeMesh& target,
                                     const std::vector<Correspondence>& correspondences,
                                     const CoarseRegistration& coarse,
                                     const RegistrationOptions& options,
                                     const parallel::Arena& arena,
                                     const RegistrationHooks& hooks = {});

// Resumes Sharpen(), without the coarse meshes. Errors: also kFailedPrecondition if the state is
// not one of this source.
absl::StatusOr<Registration> ResumeSharpening(const mesh::SpaceTimeMesh& source,
                                              const mesh::SpaceTimeMesh& target,
                                              const std::vector<Correspondence>& correspondences,
                                              const SharpenState& state,
                                              const RegistrationOptions& options,
                                              const parallel::Arena& arena,
                                              const RegistrationHooks& hooks = {});

}  // namespace liquidblend::registration

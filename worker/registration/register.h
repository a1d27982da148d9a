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

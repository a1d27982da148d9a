#include "worker/jobs/register_meshes.h"

#include <Eigen/Core>
#include <array>
#include <optional>
#include <utility>
#include <variant>

#include "core/base/memory.h"
#include "core/base/status_macros.h"
#include "worker/jobs/pre_roll.h"
#include "worker/registration/compete.h"
#include "worker/registration/fit/state.h"
#include "worker/registration/transfer.h"

namespace liquidblend::jobs {
namespace {

using registration::PreviousRegistration;
using registration::Registration;

absl::StatusOr<Registration> RegisterOrRefineMeshes(
    const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target,
    const std::vector<registration::Correspondence>& correspondences,
    const PreviousRegistration* previous, registration::RegistrationOptions options,
    const parallel::Arena& arena, const registration::RegistrationHooks& hooks) {
  if (previous == nullptr) {
    return registration::RegisterWithBestPairing(source, target, correspondences, options, arena,
                                                 hooks);
  }
  options.pairing = registration::KeptPairing(previous->hypotheses, options.pairing);
  LB_ASSIGN_OR_RETURN(Registration result, registration::Refine(source, target, correspondences,
                                                                *previous, options, arena, hooks));
  result.report.hypotheses = previous->hypotheses;
  return result;
}

absl::StatusOr<mesh::SpaceTimeMesh> BuildCoarse(const MeshSource& fine, double scale,
                                                spacetime::BuildOptions options,
                                                const parallel::Arena& arena) {
  LB_ASSIGN_OR_RETURN(mesh::Animation animation, fine.read());
  options.connectivity = spacetime::Connectivity::kRebuilt;  // a tracked mesh has no coarser one
  options.edge_scale = scale;
  options.droplet_vertices /= scale * scale;  // the same parts are droplets
  AddPreRoll(fine.pre_roll, animation);
  return BuildWithPreRoll(animation, fine.pre_roll, options, arena);
}

// The state of the finer nodes, if the registration has come to them; else null.
const registration::SharpenState* FinerNodesOf(const registration::RegistrationState* state) {
  return state == nullptr ? nullptr : std::get_if<registration::SharpenState>(state);
}

}  // namespace

absl::StatusOr<Registration> RegisterMeshes(
    const MeshSource& source, const MeshSource& target,
    const std::vector<registration::Correspondence>& correspondences,
    const PreviousRegistration* previous, const RegisterMeshesOptions& options,
    const parallel::Arena& arena, const registration::RegistrationHooks& hooks) {
  base::ReturnFreeMemory();  // of what the meshes were made from
  const double scale = registration::CoarseScale(source.mesh.num_vertices(), options.registration);
  if (scale == 1.0) {
    return RegisterOrRefineMeshes(source.mesh, target.mesh, correspondences, previous,
                                  options.registration, arena, hooks);
  }
  if (const auto* const state = FinerNodesOf(hooks.resume)) {
    return registration::ResumeSharpening(source.mesh, target.mesh, correspondences, *state,
                                          options.registration, arena, hooks);
  }
  std::array<absl::StatusOr<mesh::SpaceTimeMesh>, 2> built;
  arena.Run(2, [&](int64_t n) {
    built[n] = BuildCoarse(n == 0 ? source : target, scale, options.build, arena);
  });
  LB_ASSIGN_OR_RETURN(const mesh::SpaceTimeMesh coarse_source, std::move(built[0]));
  LB_ASSIGN_OR_RETURN(const mesh::SpaceTimeMesh coarse_target, std::move(built[1]));
  Eigen::Matrix4Xf coarse_displacement;
  std::optional<PreviousRegistration> coarse_previous;
  if (previous != nullptr) {
    const registration::TransferSource fine(source.mesh, arena);
    coarse_displacement =
        registration::Transfer(fine, coarse_source, arena).Apply(previous->displacement, arena);
    coarse_previous.emplace(
        PreviousRegistration{coarse_displacement, previous->correspondences, previous->hypotheses});
  }
  LB_ASSIGN_OR_RETURN(const Registration coarse,
                      RegisterOrRefineMeshes(
                          coarse_source, coarse_target, correspondences,
                          coarse_previous ? &*coarse_previous : nullptr,
                          registration::CoarseOptions(scale, options.registration), arena, hooks));
  return registration::Sharpen(source.mesh, target.mesh, correspondences, {coarse_source, coarse},
                               options.registration, arena, hooks);
}

}  // namespace liquidblend::jobs

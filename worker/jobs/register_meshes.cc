#include "worker/jobs/register_meshes.h"

#include <Eigen/Core>
#include <array>
#include <optional>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "core/base/memory.h"
#include "core/base/status_macros.h"
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
    const PreviousRegistration* previous, const registration::RegistrationOptions& options,
    const parallel::Arena& arena, const registration::RegistrationHooks& hooks) {
  if (previous == nullptr) {
    return registration::Register(source, target, correspondences, options, arena, hooks);
  }
  return registration::Refine(source, target, correspondences, *previous, options, arena, hooks);
}

absl::StatusOr<mesh::SpaceTimeMesh> BuildCoarse(const MeshSource& fine, double scale,
                                                spacetime::BuildOptions options,
                                                const parallel::Arena& arena) {
  LB_ASSIGN_OR_RETURN(const mesh::Animation animation, fine.read());
  options.connectivity = spacetime::Connectivity::kRebuilt;  // a tracked mesh has no coarser one
  options.edge_scale = scale;
  options.droplet_vertices /= scale * scale;  // the same parts are droplets
  return spacetime::Build(animation, options, arena);
}

// Builds the coarse meshes of both.
struct CoarseMeshes {
  mesh::SpaceTimeMesh source, target;
};
absl::StatusOr<CoarseMeshes> BuildCoarseMeshes(const MeshSource& source, const MeshSource& target,
                                               double scale, const spacetime::BuildOptions& options,
                                               const parallel::Arena& arena) {
  std::array<absl::StatusOr<mesh::SpaceTimeMesh>, 2> built;
  arena.Run(2, [&](int64_t n) {
    built[n] = BuildCoarse(n == 0 ? source : target, scale, options, arena);
  });
  LB_RETURN_IF_ERROR(built[0].status());
  LB_RETURN_IF_ERROR(built[1].status());
  return CoarseMeshes{*std::move(built[0]), *std::move(built[1])};
}

// Whether coarse meshes cannot be built or registered, whenever it is tried.
bool IsForGood(const absl::Status& status) {
  return absl::IsInvalidArgument(status) || absl::IsFailedPrecondition(status) ||
         absl::IsInternal(status);
}

absl::StatusOr<registration::Competition> CompeteOnCoarseMeshes(
    const MeshSource& source, const MeshSource& target,
    const std::vector<registration::Correspondence>& correspondences,
    const RegisterMeshesOptions& options, const parallel::Arena& arena) {
  const double scale = registration::CompetitionScale(source.mesh.num_vertices());
  LB_ASSIGN_OR_RETURN(const CoarseMeshes coarse,
                      BuildCoarseMeshes(source, target, scale, options.build, arena));
  return registration::Compete(coarse.source, coarse.target, scale, correspondences,
                               options.registration, arena);
}

// Chooses which pairs of features guide the registration. Coarse meshes may not be fit for one
// where fine ones are: then there is no choice. Errors: those of reading the frames.
absl::StatusOr<registration::Competition> ChoosePairing(
    const MeshSource& source, const MeshSource& target,
    const std::vector<registration::Correspondence>& correspondences,
    const RegisterMeshesOptions& options, const parallel::Arena& arena) {
  if (!options.registration.automatic_correspondences ||
      source.mesh.num_vertices() < options.min_vertices_to_compare) {
    return registration::Competition();
  }
  auto competition = CompeteOnCoarseMeshes(source, target, correspondences, options, arena);
  if (!IsForGood(competition.status())) return competition;
  base::LogWarning(absl::StrCat("pairings are not compared: ", competition.status().ToString()));
  return registration::Competition();
}

// The state of the finer nodes, if the registration has come to them; else null.
const registration::SharpenState* FinerNodesOf(const registration::RegistrationState* state) {
  return state == nullptr ? nullptr : std::get_if<registration::SharpenState>(state);
}

// Registers or refines with the options' pairing, coarse to fine where the meshes are large.
absl::StatusOr<Registration> RegisterWithPairing(
    const MeshSource& source, const MeshSource& target,
    const std::vector<registration::Correspondence>& correspondences,
    const PreviousRegistration* previous, const RegisterMeshesOptions& options,
    const parallel::Arena& arena, const registration::RegistrationHooks& hooks) {
  const double scale = registration::CoarseScale(source.mesh.num_vertices(), options.registration);
  if (scale == 1.0) {
    return RegisterOrRefineMeshes(source.mesh, target.mesh, correspondences, previous,
                                  options.registration, arena, hooks);
  }
  if (const auto* const state = FinerNodesOf(hooks.resume)) {
    return registration::ResumeSharpening(source.mesh, target.mesh, correspondences, *state,
                                          options.registration, arena, hooks);
  }
  LB_ASSIGN_OR_RETURN(const CoarseMeshes meshes,
                      BuildCoarseMeshes(source, target, scale, options.build, arena));
  Eigen::Matrix4Xf coarse_displacement;
  std::optional<PreviousRegistration> coarse_previous;
  if (previous != nullptr) {
    const registration::TransferSource fine(source.mesh, arena);
    coarse_displacement =
        registration::Transfer(fine, meshes.source, arena).Apply(previous->displacement, arena);
    coarse_previous.emplace(PreviousRegistration{coarse_displacement, previous->correspondences});
  }
  LB_ASSIGN_OR_RETURN(const Registration coarse,
                      RegisterOrRefineMeshes(
                          meshes.source, meshes.target, correspondences,
                          coarse_previous ? &*coarse_previous : nullptr,
                          registration::CoarseOptions(scale, options.registration), arena, hooks));
  return registration::Sharpen(source.mesh, target.mesh, correspondences, {meshes.source, coarse},
                               options.registration, arena, hooks);
}

}  // namespace

absl::StatusOr<Registration> RegisterMeshes(
    const MeshSource& source, const MeshSource& target,
    const std::vector<registration::Correspondence>& correspondences,
    const PreviousRegistration* previous, const RegisterMeshesOptions& options,
    const parallel::Arena& arena, const registration::RegistrationHooks& hooks) {
  base::ReturnFreeMemory();  // of what the meshes were made from
  LB_ASSIGN_OR_RETURN(const registration::Competition competition,
                      ChoosePairing(source, target, correspondences, options, arena));
  base::ReturnFreeMemory();
  RegisterMeshesOptions chosen = options;
  chosen.registration.pairing = competition.winner;
  LB_ASSIGN_OR_RETURN(Registration result, RegisterWithPairing(source, target, correspondences,
                                                               previous, chosen, arena, hooks));
  result.report.hypotheses = competition.hypotheses;
  return result;
}

}  // namespace liquidblend::jobs

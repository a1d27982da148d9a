// Two space-time meshes -> their registration, coarse to fine where they are large.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"
#include "worker/registration/features/pre_roll.h"
#include "worker/registration/register.h"
#include "worker/spacetime/build.h"

namespace liquidblend::jobs {

// A space-time mesh, and a function that reads its frames again, for a coarser mesh. Mesh and
// pre-roll must outlive it. The frames of source and target may be read at the same time.
struct MeshSource {
  const mesh::SpaceTimeMesh& mesh;
  std::function<absl::StatusOr<mesh::Animation>()> read;  // without the pre-roll
  const registration::PreRoll* pre_roll = nullptr;        // of the mesh; null: it has none
};

struct RegisterMeshesOptions {
  spacetime::BuildOptions build;  // of the meshes
  registration::RegistrationOptions registration;
};

//   previous  registration to refine; null: from scratch
//   hooks     resume: coarse meshes are not made again if their registration is done
// Errors: those of Build(), Register(), Refine(), Sharpen() and of reading the frames.
// Threads: safe, same bytes for any thread count.
absl::StatusOr<registration::Registration> RegisterMeshes(
    const MeshSource& source, const MeshSource& target,
    const std::vector<registration::Correspondence>& correspondences,
    const registration::PreviousRegistration* previous, const RegisterMeshesOptions& options,
    const parallel::Arena& arena, const registration::RegistrationHooks& hooks = {});

}  // namespace liquidblend::jobs

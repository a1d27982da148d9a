// Pre-roll of a registration's source (worker/registration/features/pre_roll.h).
#pragma once

#include <functional>
#include <optional>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"
#include "liquidblend/store/v1/records.pb.h"
#include "worker/jobs/job_context.h"
#include "worker/registration/features/pre_roll.h"
#include "worker/spacetime/build.h"

namespace liquidblend::jobs {

// The pre-roll that the targets of a job need, found from the first frames of its animations; the
// same for all targets. None without automatic correspondences. A refinement has one if the family
// has.
//   previous  registration to refine; null: from scratch
// Errors: those of the store.
absl::StatusOr<std::optional<registration::PreRoll>> ReadPreRoll(
    const store::v1::RegisterJob& job, const mesh::RegisteredFamily* previous, JobContext& context);

inline const registration::PreRoll* PointerTo(
    const std::optional<registration::PreRoll>& pre_roll) {
  return pre_roll ? &*pre_roll : nullptr;
}

// Adds the pre-roll to an animation; null: nothing.
void AddPreRoll(const registration::PreRoll* pre_roll, mesh::Animation& animation);

// Builds the space-time mesh of an animation with this pre-roll; null: it has none.
// Errors: those of Build().
absl::StatusOr<mesh::SpaceTimeMesh> BuildWithPreRoll(
    const mesh::Animation& animation, const registration::PreRoll* pre_roll,
    const spacetime::BuildOptions& options, const parallel::Arena& arena,
    const std::function<void(double)>& progress = {});

}  // namespace liquidblend::jobs

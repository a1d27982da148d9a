// One target of a family: stored animations -> the registration of the source to it.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"
#include "core/mesh/space_time_report.h"
#include "liquidblend/store/v1/records.pb.h"
#include "worker/jobs/assemble_family.h"
#include "worker/jobs/job_context.h"
#include "worker/registration/features/pre_roll.h"

namespace liquidblend::jobs {

absl::StatusOr<mesh::Animation> ReadStored(const std::string& id, JobContext& context);

struct BuiltMesh {
  mesh::SpaceTimeMesh mesh;
  mesh::SpaceTimeReport report;
};

// An animation to build a mesh of.
struct MeshInput {
  std::string id;
  const registration::PreRoll* pre_roll = nullptr;  // added unless the animation is tracked
};

// Reads animations and builds their space-time meshes, side by side; the same bytes on any worker,
// for any number of threads. Errors: those of the stages and the store, for the first one that has
// any.
absl::StatusOr<std::vector<BuiltMesh>> BuildMeshes(const std::vector<MeshInput>& inputs,
                                                   const store::v1::RegisterJob& job,
                                                   JobContext& context);

// The source's mesh with its pre-roll; null: it has none.
struct SourceMesh {
  const mesh::SpaceTimeMesh& mesh;
  const registration::PreRoll* pre_roll = nullptr;
};

// Shares of the whole job.
struct StageRange {
  double begin = 0.0;
  double end = 1.0;
};

//   previous  registration to refine; null: from scratch
// Errors: those of the stages and the store, and LeaseKeeper::Check()'s.
absl::StatusOr<RegisteredTarget> RegisterTarget(const store::v1::RegisterJob& job, int target_index,
                                                const SourceMesh& source, const BuiltMesh& target,
                                                const mesh::RegisteredFamily* previous,
                                                const StageRange& range, JobContext& context);

}  // namespace liquidblend::jobs

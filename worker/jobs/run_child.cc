#include "worker/jobs/run_child.h"

#include <optional>
#include <string>
#include <vector>

#include "core/base/status_macros.h"
#include "worker/jobs/attempt/publish.h"
#include "worker/jobs/job_options.h"
#include "worker/jobs/pre_roll.h"
#include "worker/jobs/previous_version.h"
#include "worker/jobs/register_target.h"
#include "worker/jobs/target_files.h"

namespace liquidblend::jobs {
namespace {

// Shares of the child: the meshes, the registration, storing the result.
constexpr double kMeshesDone = 0.22;
constexpr double kTargetDone = 0.98;

// Registers the target, and stores the result.
absl::StatusOr<store::BlobId> MakeTargetFile(const store::v1::RegisterJob& job, int k,
                                             const mesh::RegisteredFamily* previous,
                                             JobContext& context) {
  LB_RETURN_IF_ERROR(context.BeginStage("space-time meshes", 0.0, kMeshesDone));
  LB_ASSIGN_OR_RETURN(const std::optional<registration::PreRoll> pre_roll,
                      ReadPreRoll(job, previous, context));
  LB_ASSIGN_OR_RETURN(
      const std::vector<BuiltMesh> built,
      BuildMeshes({{job.source(), PointerTo(pre_roll)}, {job.targets(k)}}, job, context));
  const mesh::SpaceTimeMesh& source = built.front().mesh;
  if (previous != nullptr) LB_RETURN_IF_ERROR(CheckSameVertices(*previous, source));
  LB_ASSIGN_OR_RETURN(
      const RegisteredTarget target,
      RegisterTarget(job, k, {source, source.num_pre_roll > 0 ? PointerTo(pre_roll) : nullptr},
                     built.back(), previous, {kMeshesDone, kTargetDone}, context));
  LB_RETURN_IF_ERROR(context.BeginStage("storing", kTargetDone, 1.0));
  return StoreTarget(target, HashOf(source), context.blobs);
}

}  // namespace

absl::Status RunChild(const store::v1::JobRecord& child, JobContext& context) {
  const int k = child.register_target().target_index();
  context.set_target_index(k);
  LB_ASSIGN_OR_RETURN(const store::v1::JobRecord parent, context.catalog.GetJob(child.parent()));
  const store::v1::RegisterJob& job = parent.register_family();
  LB_RETURN_IF_ERROR(CheckOptions(job));
  LB_ASSIGN_OR_RETURN(const PreviousVersion opened, OpenPreviousVersion(job, context));
  const mesh::RegisteredFamily* const previous = opened.get();
  const bool is_kept = previous != nullptr && IsKept(job, k, *previous);
  const absl::StatusOr<store::BlobId> blob =
      is_kept ? StoreTarget(KeptTarget(*previous, k), /*source_mesh=*/"", context.blobs)
              : MakeTargetFile(job, k, previous, context);
  LB_RETURN_IF_ERROR(opened.CheckFile());
  LB_RETURN_IF_ERROR(blob.status());
  return PublishWhileLeased(context.keeper, [&] {
    return context.catalog.FinishChild(context.keeper.lease_id(), *blob);
  });
}

}  // namespace liquidblend::jobs

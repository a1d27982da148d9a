#include "worker/jobs/register_target.h"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/files.h"
#include "worker/jobs/job_options.h"
#include "worker/jobs/previous_version.h"
#include "worker/jobs/register_meshes.h"
#include "worker/registration/register.h"
#include "worker/spacetime/build.h"
#include "worker/spacetime/report.h"

namespace liquidblend::jobs {
namespace {

constexpr double kTargetMeshShare = 0.15;  // of the work for one target

absl::StatusOr<registration::Registration> RegisterOrRefine(
    const store::v1::RegisterJob& job, int k, const mesh::RegisteredFamily* previous,
    const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target, JobContext& context) {
  const auto read = [&context](const std::string& id) {
    return [&context, id] { return ReadStored(id, context); };
  };
  const RegisterMeshesOptions options = {ToBuildOptions(job.space_time()),
                                         ToRegistrationOptions(job.options())};
  Eigen::Matrix4Xf displacement;
  std::vector<mesh::Correspondence> before;
  std::optional<registration::PreviousRegistration> refined;
  if (previous != nullptr) {
    displacement = MatrixOf(previous->targets[k].displacement);
    before = CorrespondencesOf(previous->targets[k]);
    refined.emplace(displacement, before);
  }
  return RegisterMeshes({source, read(job.source())}, {target, read(job.targets(k))},
                        ToCorrespondences(job, k, source.frames_per_second),
                        refined ? &*refined : nullptr, options, context.arena,
                        context.RegistrationProgress(k));
}

}  // namespace

absl::StatusOr<mesh::Animation> ReadStored(const std::string& id, JobContext& context) {
  LB_ASSIGN_OR_RETURN(const store::v1::AnimationRecord record, context.catalog.GetAnimation(id));
  LB_ASSIGN_OR_RETURN(const std::shared_ptr<const store::Blob> blob,
                      context.blobs.Open(record.blob()));
  return store::ReadAnimation(*blob, absl::StrCat("animation '", id, "'"));
}

absl::StatusOr<BuiltMesh> BuildMesh(const std::string& id, const store::v1::RegisterJob& job,
                                    JobContext& context) {
  spacetime::BuildOptions options = ToBuildOptions(job.space_time());
  LB_ASSIGN_OR_RETURN(const mesh::Animation animation, ReadStored(id, context));
  LB_ASSIGN_OR_RETURN(options.connectivity,
                      spacetime::ChooseConnectivity(animation, options, context.arena));
  BuiltMesh built;
  LB_ASSIGN_OR_RETURN(built.mesh,
                      spacetime::Build(animation, options, context.arena, context.StageProgress()));
  built.report = spacetime::Report(animation, built.mesh, options, context.arena);
  return built;
}

absl::StatusOr<RegisteredTarget> RegisterTarget(const store::v1::RegisterJob& job, int target_index,
                                                const mesh::SpaceTimeMesh& source,
                                                const mesh::RegisteredFamily* previous,
                                                const StageRange& range, JobContext& context) {
  const double middle = range.begin + kTargetMeshShare * (range.end - range.begin);
  LB_RETURN_IF_ERROR(context.BeginStage("space-time mesh", range.begin, middle));
  LB_ASSIGN_OR_RETURN(const BuiltMesh target, BuildMesh(job.targets(target_index), job, context));
  LB_RETURN_IF_ERROR(context.BeginStage("registration", middle, range.end));
  RegisteredTarget result;
  result.name = job.targets(target_index);
  result.space_time = target.report;
  LB_ASSIGN_OR_RETURN(result.registration,
                      RegisterOrRefine(job, target_index, previous, source, target.mesh, context));
  return result;
}

}  // namespace liquidblend::jobs

#include "worker/jobs/run_registration.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/files.h"
#include "core/store/parameter_records.h"
#include "worker/jobs/assemble_family.h"
#include "worker/jobs/job_options.h"
#include "worker/jobs/previous_version.h"
#include "worker/jobs/stored_file.h"
#include "worker/registration/register.h"
#include "worker/registration/transfer.h"
#include "worker/spacetime/build.h"
#include "worker/spacetime/report.h"

namespace liquidblend::jobs {
namespace {

// Shares of the whole job: the source's mesh, the targets, the levels of detail, publishing.
constexpr double kTargetsBegin = 0.1;
constexpr double kTargetsEnd = 0.9;
constexpr double kLevelsEnd = 0.97;
constexpr double kTargetMeshShare = 0.15;  // of the work for one target

absl::StatusOr<mesh::Animation> ReadStored(const std::string& id, JobContext& context) {
  LB_ASSIGN_OR_RETURN(const store::v1::AnimationRecord record, context.catalog.GetAnimation(id));
  LB_ASSIGN_OR_RETURN(const std::shared_ptr<const store::Blob> blob,
                      context.blobs.Open(record.blob()));
  return store::ReadAnimation(*blob, absl::StrCat("animation '", id, "'"));
}

struct BuiltMesh {
  mesh::SpaceTimeMesh mesh;
  mesh::SpaceTimeReport report;
};

// Reads one animation of the family and makes its space-time mesh; `bounds` grows around it.
absl::StatusOr<BuiltMesh> BuildMesh(const std::string& id, spacetime::BuildOptions options,
                                    JobContext& context, Eigen::AlignedBox3f& bounds) {
  LB_ASSIGN_OR_RETURN(const mesh::Animation animation, ReadStored(id, context));
  bounds.extend(BoxOf(animation));
  LB_ASSIGN_OR_RETURN(options.connectivity,
                      spacetime::ChooseConnectivity(animation, options, context.arena));
  BuiltMesh built;
  LB_ASSIGN_OR_RETURN(built.mesh,
                      spacetime::Build(animation, options, context.arena, context.StageProgress()));
  built.report = spacetime::Report(animation, built.mesh, options, context.arena);
  return built;
}

absl::StatusOr<registration::Registration> RegisterOrRefine(
    const store::v1::RegisterJob& job, int k, const mesh::RegisteredFamily* previous,
    const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target, JobContext& context) {
  const auto correspondences = ToCorrespondences(job, k, source.frames_per_second);
  const registration::RegistrationOptions options = ToRegistrationOptions(job.options());
  if (previous == nullptr) {
    return registration::Register(source, target, correspondences, options, context.arena,
                                  context.RegistrationProgress(k));
  }
  const Eigen::Matrix4Xf displacement = DisplacementOf(previous->targets[k]);
  const auto before = CorrespondencesOf(previous->targets[k]);
  return registration::Refine(source, target, correspondences, {displacement, before}, options,
                              context.arena, context.RegistrationProgress(k));
}

//   previous  what to refine; null: from scratch
absl::StatusOr<RegisteredTarget> RegisterTarget(const store::v1::RegisterJob& job, int k,
                                                const mesh::RegisteredFamily* previous,
                                                FamilyParts& parts, JobContext& context) {
  const double share = (kTargetsEnd - kTargetsBegin) / job.targets_size();
  const double begin = kTargetsBegin + k * share;
  const double middle = begin + kTargetMeshShare * share;
  LB_RETURN_IF_ERROR(context.BeginStage("space-time mesh", begin, middle));
  LB_ASSIGN_OR_RETURN(
      const BuiltMesh target,
      BuildMesh(job.targets(k), ToBuildOptions(job.space_time()), context, parts.bounds));
  LB_RETURN_IF_ERROR(context.BeginStage("registration", middle, begin + share));
  RegisteredTarget result;
  result.name = job.targets(k);
  result.space_time = target.report;
  LB_ASSIGN_OR_RETURN(result.registration,
                      RegisterOrRefine(job, k, previous, parts.source, target.mesh, context));
  return result;
}

// The source's mesh on a coarser grid, moved as the finest one is.
absl::StatusOr<FamilyLevel> MakeLevel(const mesh::Animation& source,
                                      const spacetime::BuildOptions& options,
                                      const FamilyParts& parts, JobContext& context) {
  FamilyLevel level;
  LB_ASSIGN_OR_RETURN(level.mesh, spacetime::Build(source, options, context.arena));
  const registration::Transfer transfer(parts.source, level.mesh, context.arena);
  for (const RegisteredTarget& target : parts.targets) {
    registration::Registration& moved = level.targets.emplace_back();
    moved.displacement = transfer.Apply(target.registration.displacement, context.arena);
    moved.extrapolation = transfer.Apply(target.registration.extrapolation, context.arena);
  }
  return level;
}

absl::Status MakeLevels(const store::v1::RegisterJob& job, FamilyParts& parts,
                        JobContext& context) {
  const int num_levels = NumCoarserLevels(job.space_time());
  if (num_levels == 0) return absl::OkStatus();
  LB_RETURN_IF_ERROR(context.BeginStage("levels of detail", kTargetsEnd, kLevelsEnd));
  LB_ASSIGN_OR_RETURN(const mesh::Animation source, ReadStored(job.source(), context));
  for (int level = 1; level <= num_levels; ++level) {
    LB_RETURN_IF_ERROR(context.keeper.Check());
    LB_ASSIGN_OR_RETURN(FamilyLevel made,
                        MakeLevel(source, ToLevelOptions(job.space_time(), level), parts, context));
    parts.coarser_levels.push_back(std::move(made));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status RunRegistration(const store::v1::RegisterJob& job, JobContext& context) {
  LB_RETURN_IF_ERROR(CheckOptions(job));
  std::optional<mesh::RegisteredFamily> previous;
  if (job.refine_version() != 0) {
    LB_ASSIGN_OR_RETURN(previous, OpenPreviousVersion(job, context));
  }
  FamilyParts parts;
  parts.name = job.family();
  parts.source_name = job.source();
  parts.parameter_space = store::FromMessage(job.parameter_space());
  LB_RETURN_IF_ERROR(context.BeginStage("space-time mesh", 0.0, kTargetsBegin));
  LB_ASSIGN_OR_RETURN(BuiltMesh source, BuildMesh(job.source(), ToBuildOptions(job.space_time()),
                                                  context, parts.bounds));
  parts.source = std::move(source.mesh);
  parts.source_report = source.report;
  if (previous) LB_RETURN_IF_ERROR(CheckSameVertices(*previous, parts.source));
  for (int k = 0; k < job.targets_size(); ++k) {
    LB_ASSIGN_OR_RETURN(RegisteredTarget target,
                        RegisterTarget(job, k, previous ? &*previous : nullptr, parts, context));
    parts.targets.push_back(std::move(target));
  }
  LB_RETURN_IF_ERROR(MakeLevels(job, parts, context));
  LB_RETURN_IF_ERROR(context.BeginStage("publishing", kLevelsEnd, 1.0));
  LB_ASSIGN_OR_RETURN(const mesh::RegisteredFamily family, AssembleFamily(std::move(parts)));
  LB_ASSIGN_OR_RETURN(const store::v1::FamilyRecord record, StoreFamily(family, context.blobs));
  LB_RETURN_IF_ERROR(context.keeper.Check());
  return context.catalog.PublishFamily(context.keeper.lease_id(), record).status();
}

}  // namespace liquidblend::jobs

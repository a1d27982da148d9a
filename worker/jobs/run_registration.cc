#include "worker/jobs/run_registration.h"

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/catalog.h"
#include "core/store/parameter_records.h"
#include "worker/jobs/assemble_family.h"
#include "worker/jobs/job_options.h"
#include "worker/jobs/previous_version.h"
#include "worker/jobs/register_target.h"
#include "worker/jobs/registered_part.h"
#include "worker/jobs/stored_file.h"
#include "worker/registration/transfer.h"
#include "worker/spacetime/build.h"

namespace liquidblend::jobs {
namespace {

// Shares of the whole job: the source's mesh, the targets (or their parts), the levels of detail,
// publishing.
constexpr double kSourceEnd = 0.1;
constexpr double kTargetsEnd = store::kPartsShare;
constexpr double kSourceAfterPartsEnd = 0.93;
constexpr double kLevelsEnd = 0.97;

// Of the source's and the targets' frames.
absl::StatusOr<Eigen::AlignedBox3f> BoundsOf(const store::v1::RegisterJob& job,
                                             store::Catalog& catalog) {
  std::vector<std::string> ids(job.targets().begin(), job.targets().end());
  ids.push_back(job.source());
  Eigen::AlignedBox3f bounds;
  for (const std::string& id : ids) {
    LB_ASSIGN_OR_RETURN(const store::v1::AnimationRecord record, catalog.GetAnimation(id));
    const store::v1::Box& box = record.manifest().bounds();
    if (box.min_size() != 3 || box.max_size() != 3) {
      return absl::DataLossError(absl::StrCat("the record of animation '", id, "' has no bounds"));
    }
    bounds.extend(Eigen::AlignedBox3f(Eigen::Map<const Eigen::Vector3f>(box.min().data()),
                                      Eigen::Map<const Eigen::Vector3f>(box.max().data())));
  }
  return bounds;
}

absl::StatusOr<std::vector<RegisteredTarget>> RegisterTargets(
    const store::v1::RegisterJob& job, const mesh::SpaceTimeMesh& source,
    const mesh::RegisteredFamily* previous, JobContext& context) {
  const double share = (kTargetsEnd - kSourceEnd) / job.targets_size();
  std::vector<RegisteredTarget> targets;
  for (int k = 0; k < job.targets_size(); ++k) {
    if (previous != nullptr && IsKept(job, k, *previous)) {
      targets.push_back(KeptTarget(*previous, k));
      continue;
    }
    const StageRange range = {kSourceEnd + k * share, kSourceEnd + (k + 1) * share};
    LB_ASSIGN_OR_RETURN(RegisteredTarget target,
                        RegisterTarget(job, k, source, previous, range, context));
    targets.push_back(std::move(target));
  }
  return targets;
}

// What the parts have come to.
absl::StatusOr<std::vector<RegisteredTarget>> ReadTargets(
    const store::v1::RegisterJob& job, const std::vector<store::v1::JobRecord>& parts,
    const mesh::SpaceTimeMesh& source, JobContext& context) {
  const std::string source_mesh = HashOf(source);
  std::vector<RegisteredTarget> targets;
  for (const store::v1::JobRecord& part : parts) {
    const std::string& name = job.targets(part.register_target().target_index());
    LB_ASSIGN_OR_RETURN(RegisteredTarget target,
                        ReadPart(part.result_blob(), name, source_mesh, context.blobs));
    targets.push_back(std::move(target));
  }
  return targets;
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
  LB_ASSIGN_OR_RETURN(const std::vector<store::v1::JobRecord> done,
                      context.catalog.ListParts(context.keeper.job().id()));
  LB_ASSIGN_OR_RETURN(const std::optional<mesh::RegisteredFamily> previous,
                      OpenPreviousVersion(job, context));
  LB_RETURN_IF_ERROR(context.BeginStage("space-time mesh", done.empty() ? 0.0 : kTargetsEnd,
                                        done.empty() ? kSourceEnd : kSourceAfterPartsEnd));
  LB_ASSIGN_OR_RETURN(BuiltMesh source, BuildMesh(job.source(), job, context));
  if (previous) LB_RETURN_IF_ERROR(CheckSameVertices(*previous, source.mesh));
  FamilyParts parts;
  parts.name = job.family();
  parts.source_name = job.source();
  parts.parameter_space = store::FromMessage(job.parameter_space());
  parts.source = std::move(source.mesh);
  parts.source_report = source.report;
  LB_ASSIGN_OR_RETURN(parts.bounds, BoundsOf(job, context.catalog));
  LB_ASSIGN_OR_RETURN(
      parts.targets,
      done.empty() ? RegisterTargets(job, parts.source, previous ? &*previous : nullptr, context)
                   : ReadTargets(job, done, parts.source, context));
  LB_RETURN_IF_ERROR(MakeLevels(job, parts, context));
  LB_RETURN_IF_ERROR(context.BeginStage("publishing", kLevelsEnd, 1.0));
  LB_ASSIGN_OR_RETURN(const mesh::RegisteredFamily family, AssembleFamily(std::move(parts)));
  LB_ASSIGN_OR_RETURN(const store::v1::FamilyRecord record, StoreFamily(family, context.blobs));
  LB_RETURN_IF_ERROR(context.keeper.Check());
  return context.catalog.PublishFamily(context.keeper.lease_id(), record).status();
}

}  // namespace liquidblend::jobs

#include "worker/jobs/run_registration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog.h"
#include "core/store/files/parameter_records.h"
#include "worker/jobs/assemble_family.h"
#include "worker/jobs/attempt/publish.h"
#include "worker/jobs/job_options.h"
#include "worker/jobs/pre_roll.h"
#include "worker/jobs/previous_version.h"
#include "worker/jobs/register_target.h"
#include "worker/jobs/required_grade.h"
#include "worker/jobs/stored_file.h"
#include "worker/jobs/target_files.h"
#include "worker/registration/transfer.h"
#include "worker/spacetime/build.h"

namespace liquidblend::jobs {
namespace {

// Shares of the whole job: the source's mesh, or those of source and target, the targets (or their
// children and those of them that are registered here), the levels of detail, publishing.
constexpr double kSourceEnd = 0.1;
constexpr double kMeshesEnd = 0.22;
constexpr double kTargetMeshShare = 0.15;  // of one of several targets
constexpr double kTargetsEnd = store::kChildrenShare;
constexpr double kSourceAfterChildrenEnd = 0.93;
constexpr double kLateTargetsEnd = 0.95;
constexpr double kLevelsEnd = 0.97;
// How often a child is repeated because another version of the program did it.
constexpr int kMaxRepeats = 2;

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

// Of a job with a single target, whose mesh there is already.
absl::StatusOr<std::vector<RegisteredTarget>> RegisterOnly(const store::v1::RegisterJob& job,
                                                           const SourceMesh& source,
                                                           const BuiltMesh& target,
                                                           const mesh::RegisteredFamily* previous,
                                                           JobContext& context) {
  LB_ASSIGN_OR_RETURN(
      RegisteredTarget registered,
      RegisterTarget(job, 0, source, target, previous, {kMeshesEnd, kTargetsEnd}, context));
  std::vector<RegisteredTarget> targets;
  targets.push_back(std::move(registered));
  return targets;
}

// Makes the mesh of a target, and registers it within this share of the job.
absl::StatusOr<RegisteredTarget> RegisterOneOf(const store::v1::RegisterJob& job, int k,
                                               const SourceMesh& source,
                                               const mesh::RegisteredFamily* previous,
                                               const StageRange& range, JobContext& context) {
  const double middle = range.begin + kTargetMeshShare * (range.end - range.begin);
  LB_RETURN_IF_ERROR(context.BeginStage("space-time meshes", range.begin, middle));
  LB_ASSIGN_OR_RETURN(const std::vector<BuiltMesh> built,
                      BuildMeshes({{job.targets(k)}}, job, context));
  return RegisterTarget(job, k, source, built.front(), previous, {middle, range.end}, context);
}

absl::StatusOr<std::vector<RegisteredTarget>> RegisterEach(const store::v1::RegisterJob& job,
                                                           const SourceMesh& source,
                                                           const mesh::RegisteredFamily* previous,
                                                           JobContext& context) {
  const double share = (kTargetsEnd - kSourceEnd) / job.targets_size();
  std::vector<RegisteredTarget> targets;
  for (int k = 0; k < job.targets_size(); ++k) {
    if (previous != nullptr && IsKept(job, k, *previous)) {
      targets.push_back(KeptTarget(*previous, k));
      continue;
    }
    const double begin = kSourceEnd + k * share;
    LB_ASSIGN_OR_RETURN(RegisteredTarget target,
                        RegisterOneOf(job, k, source, previous, {begin, begin + share}, context));
    targets.push_back(std::move(target));
  }
  return targets;
}

// How often a child that has succeeded was repeated: no other attempt that is followed by another
// one fails with this code.
int NumRepeats(const store::v1::JobRecord& child) {
  const auto& attempts = child.failed_attempts();
  return static_cast<int>(
      std::count_if(attempts.begin(), attempts.end(), [](const store::v1::FailedAttempt& attempt) {
        return attempt.error().code() == static_cast<int>(absl::StatusCode::kFailedPrecondition);
      }));
}

// Gives this job back, and these children with it. Returns the error that ends the attempt.
absl::Status RepeatChildren(const store::v1::RegisterJob& job,
                            const std::vector<store::v1::JobRecord>& children,
                            JobContext& context) {
  const absl::Status why = absl::FailedPreconditionError(
      "registered by another version of the program, to another space-time mesh of the source; it "
      "is registered again");
  std::vector<std::string> ids, targets;
  for (const store::v1::JobRecord& child : children) {
    ids.push_back(child.id());
    targets.push_back(job.targets(child.register_target().target_index()));
  }
  LB_RETURN_IF_ERROR(PublishWhileLeased(context.keeper, [&] {
    return context.catalog.RepeatChildren(context.keeper.lease_id(), ids, why);
  }));
  base::LogWarning(absl::StrCat("job ", context.keeper.job().id(), ": '",
                                absl::StrJoin(targets, "', '"), "': ", why.message(),
                                ". Do all workers run the same program?"));
  return absl::AbortedError("waits for targets that are registered again");
}

// Reads the target files of the children, all of this mesh of the source. Where workers of several
// versions share a job, some are not: such children are repeated, kMaxRepeats times at most, and
// then their targets are registered here.
absl::StatusOr<std::vector<RegisteredTarget>> GatherTargets(
    const store::v1::RegisterJob& job, const std::vector<store::v1::JobRecord>& children,
    const SourceMesh& source, const mesh::RegisteredFamily* previous, JobContext& context) {
  const std::string source_mesh = HashOf(source.mesh);
  std::vector<std::optional<RegisteredTarget>> read;
  std::vector<store::v1::JobRecord> repeated;
  for (const store::v1::JobRecord& child : children) {
    const std::string& name = job.targets(child.register_target().target_index());
    LB_ASSIGN_OR_RETURN(read.emplace_back(),
                        ReadTarget(child.result_blob(), name, source_mesh, context.blobs));
    if (!read.back() && NumRepeats(child) < kMaxRepeats) repeated.push_back(child);
  }
  if (!repeated.empty()) return RepeatChildren(job, repeated, context);
  const double share = (kLateTargetsEnd - kSourceAfterChildrenEnd) / job.targets_size();
  std::vector<RegisteredTarget> targets;
  for (size_t n = 0; n < read.size(); ++n) {
    if (!read[n]) {
      const int k = children[n].register_target().target_index();
      const double begin = kSourceAfterChildrenEnd + k * share;
      LB_ASSIGN_OR_RETURN(read[n],
                          RegisterOneOf(job, k, source, previous, {begin, begin + share}, context));
    }
    targets.push_back(*std::move(read[n]));
  }
  return targets;
}

// The source's mesh on a coarser grid, moved as the finest one is.
//   source  with the pre-roll, if it is not null
absl::StatusOr<FamilyLevel> MakeLevel(const mesh::Animation& source,
                                      const registration::PreRoll* pre_roll,
                                      const spacetime::BuildOptions& options,
                                      const FamilyContents& contents,
                                      const registration::TransferSource& finest,
                                      JobContext& context) {
  LB_RETURN_IF_ERROR(context.keeper.Check());
  FamilyLevel level;
  LB_ASSIGN_OR_RETURN(level.mesh, BuildWithPreRoll(source, pre_roll, options, context.arena));
  const registration::Transfer transfer(finest, level.mesh, context.arena);
  for (const RegisteredTarget& target : contents.targets) {
    registration::Registration& moved = level.targets.emplace_back();
    moved.displacement = transfer.Apply(target.registration.displacement, context.arena);
    moved.extrapolation = transfer.Apply(target.registration.extrapolation, context.arena);
  }
  return level;
}

absl::Status MakeLevels(const store::v1::RegisterJob& job, const registration::PreRoll* pre_roll,
                        FamilyContents& contents, JobContext& context) {
  const int num_levels = NumCoarserLevels(job.space_time());
  if (num_levels == 0) return absl::OkStatus();
  LB_RETURN_IF_ERROR(context.BeginStage("levels of detail", kTargetsEnd, kLevelsEnd));
  LB_ASSIGN_OR_RETURN(mesh::Animation source, ReadStored(job.source(), context));
  AddPreRoll(pre_roll, source);
  const registration::TransferSource finest(contents.source, context.arena);
  std::vector<absl::StatusOr<FamilyLevel>> levels(static_cast<size_t>(num_levels));
  context.arena.Run(num_levels, [&](int64_t n) {
    const spacetime::BuildOptions options =
        ToLevelOptions(job.space_time(), static_cast<int>(n) + 1);
    levels[n] = MakeLevel(source, pre_roll, options, contents, finest, context);
  });
  for (absl::StatusOr<FamilyLevel>& level : levels) {
    if (!level.ok()) return level.status();
    contents.coarser_levels.push_back(*std::move(level));
  }
  return context.keeper.Check();
}

TimeBlending TimeBlendingOf(const store::v1::RegisterJob& job, const FamilyContents& contents) {
  if (job.has_rest_time_s()) return {job.rest_time_s(), job.time_blending_reason()};
  if (!job.automatic_time_blending()) return {{}, job.time_blending_reason()};
  return ChooseTimeBlending(contents.targets, contents.source.frames_per_second);
}

// Registers what is not done by children, and stores the family.
absl::StatusOr<store::v1::FamilyRecord> MakeFamily(const store::v1::RegisterJob& job,
                                                   const std::vector<store::v1::JobRecord>& done,
                                                   const mesh::RegisteredFamily* previous,
                                                   JobContext& context) {
  const bool is_pair = done.empty() && job.targets_size() == 1 &&
                       (previous == nullptr || !IsKept(job, 0, *previous));
  LB_RETURN_IF_ERROR(context.BeginStage("space-time meshes", done.empty() ? 0.0 : kTargetsEnd,
                                        is_pair        ? kMeshesEnd
                                        : done.empty() ? kSourceEnd
                                                       : kSourceAfterChildrenEnd));
  LB_ASSIGN_OR_RETURN(const std::optional<registration::PreRoll> found,
                      ReadPreRoll(job, previous, context));
  std::vector<MeshInput> inputs = {{job.source(), PointerTo(found)}};
  if (is_pair) inputs.push_back({job.targets(0)});
  LB_ASSIGN_OR_RETURN(std::vector<BuiltMesh> built, BuildMeshes(inputs, job, context));
  if (previous != nullptr) {
    LB_RETURN_IF_ERROR(CheckSameVertices(*previous, built.front().mesh));
  }
  FamilyContents contents;
  contents.name = job.family();
  contents.source_name = job.source();
  contents.parameter_space = store::FromMessage(job.parameter_space());
  contents.source = std::move(built.front().mesh);
  contents.source_report = built.front().report;
  LB_ASSIGN_OR_RETURN(contents.bounds, BoundsOf(job, context.catalog));
  const bool has_pre_roll = contents.source.num_pre_roll > 0;  // a tracked mesh has none
  const SourceMesh source{contents.source, has_pre_roll ? PointerTo(found) : nullptr};
  LB_ASSIGN_OR_RETURN(contents.targets,
                      !done.empty() ? GatherTargets(job, done, source, previous, context)
                      : is_pair     ? RegisterOnly(job, source, built.back(), previous, context)
                                    : RegisterEach(job, source, previous, context));
  LB_RETURN_IF_ERROR(CheckGrades(contents.targets, job.required_grade()));
  contents.time_blending = TimeBlendingOf(job, contents);
  built.clear();  // the target's mesh is not needed any more
  LB_RETURN_IF_ERROR(MakeLevels(job, source.pre_roll, contents, context));
  LB_RETURN_IF_ERROR(context.BeginStage("publishing", kLevelsEnd, 1.0));
  LB_ASSIGN_OR_RETURN(const mesh::RegisteredFamily family, AssembleFamily(std::move(contents)));
  return StoreFamily(family, context.blobs);
}

}  // namespace

absl::Status RunRegistration(const store::v1::RegisterJob& job, JobContext& context) {
  LB_RETURN_IF_ERROR(CheckOptions(job));
  LB_ASSIGN_OR_RETURN(const std::vector<store::v1::JobRecord> done,
                      context.catalog.ListChildren(context.keeper.job().id()));
  LB_ASSIGN_OR_RETURN(const PreviousVersion previous, OpenPreviousVersion(job, context));
  const absl::StatusOr<store::v1::FamilyRecord> record =
      MakeFamily(job, done, previous.get(), context);
  LB_RETURN_IF_ERROR(previous.CheckFile());  // first: vertices that read as zeros look moved
  LB_RETURN_IF_ERROR(record.status());
  return PublishWhileLeased(context.keeper, [&] {
    return context.catalog.PublishFamily(context.keeper.lease_id(), *record).status();
  });
}

}  // namespace liquidblend::jobs

#include "worker/jobs/register_target.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/store/files/files.h"
#include "worker/jobs/fingerprint.h"
#include "worker/jobs/job_options.h"
#include "worker/jobs/pre_roll.h"
#include "worker/jobs/previous_version.h"
#include "worker/jobs/register_meshes.h"
#include "worker/registration/register.h"
#include "worker/spacetime/build.h"
#include "worker/spacetime/report.h"

namespace liquidblend::jobs {
namespace {

using registration::Registration;

// Input of a registration.
struct Inputs {
  const store::v1::RegisterJob& job;
  int target_index;
  const SourceMesh& source;
  const mesh::SpaceTimeMesh& target;
  const mesh::RegisteredFamily* previous;  // what to refine; null: from scratch
};

absl::StatusOr<Registration> RegisterOrRefine(const Inputs& inputs,
                                              const registration::RegistrationHooks& hooks,
                                              JobContext& context) {
  const store::v1::RegisterJob& job = inputs.job;
  const int k = inputs.target_index;
  const auto read = [&context](const std::string& id) {
    return [&context, id] { return ReadStored(id, context); };
  };
  const RegisterMeshesOptions options = {ToBuildOptions(job.space_time()),
                                         ToRegistrationOptions(job.options())};
  Eigen::Matrix4Xf displacement;
  std::vector<mesh::Correspondence> before;
  std::optional<registration::PreviousRegistration> refined;
  if (inputs.previous != nullptr) {
    displacement = MatrixOf(inputs.previous->targets[k].displacement);
    before = CorrespondencesOf(inputs.previous->targets[k]);
    refined.emplace(registration::PreviousRegistration{
        displacement, before, inputs.previous->targets[k].report.hypotheses});
  }
  return RegisterMeshes({inputs.source.mesh, read(job.source()), inputs.source.pre_roll},
                        {inputs.target, read(job.targets(k))},
                        ToCorrespondences(job, k, inputs.source.mesh.frames_per_second),
                        refined ? &*refined : nullptr, options, context.arena, hooks);
}

// The last iteration that the state knows of.
registration::IterationReport LastOf(const registration::RegistrationState& state) {
  if (const auto* const iterations = std::get_if<registration::IterationState>(&state)) {
    return iterations->last;
  }
  if (const auto* const competition = std::get_if<registration::CompetitionState>(&state)) {
    return competition->next ? competition->next->last : competition->best.last;
  }
  const int count = std::get<registration::SharpenState>(state).coarse_report.num_iterations;
  return {.iteration = count, .num_iterations = count};
}

// The share of the iterations that are done. Those of other pairings do not count: whether there
// are any is not known before.
double ShareOf(const registration::RegistrationState& state) {
  if (!std::holds_alternative<registration::IterationState>(state)) return 1.0;
  const registration::IterationReport last = LastOf(state);
  return static_cast<double>(last.iteration) / std::max(1, last.num_iterations);
}

// Goes on where an earlier attempt was interrupted, and leaves checkpoints for a later one.
absl::StatusOr<Registration> RegisterWithCheckpoints(const Inputs& inputs, JobContext& context) {
  LB_ASSIGN_OR_RETURN(
      const std::optional<registration::RegistrationState> resumed,
      context.checkpoints.Begin(FingerprintOf(inputs.job, inputs.target_index, inputs.source.mesh,
                                              inputs.target, inputs.previous)));
  registration::RegistrationHooks hooks;
  hooks.progress = context.RegistrationProgress(inputs.target_index);
  hooks.keep = [&context](registration::RegistrationState state) {
    context.checkpoints.Offer(std::move(state));
  };
  if (!resumed) return RegisterOrRefine(inputs, hooks, context);
  context.SetResumed(LastOf(*resumed), ShareOf(*resumed));
  hooks.resume = &*resumed;
  absl::StatusOr<Registration> result = RegisterOrRefine(inputs, hooks, context);
  if (!absl::IsFailedPrecondition(result.status())) return result;
  base::LogWarning(absl::StrCat("job ", context.keeper.job().id(), ": begins anew, as its ",
                                "checkpoint does not fit: ", result.status().ToString()));
  context.SetResumed({}, 0.0);
  hooks.resume = nullptr;
  return RegisterOrRefine(inputs, hooks, context);
}

// Jobs of older programs may have several targets in one: of these nothing is kept.
absl::StatusOr<Registration> RegisterInputs(const Inputs& inputs, JobContext& context) {
  const bool is_one_of_several =
      context.keeper.job().parent().empty() && inputs.job.targets_size() > 1;
  if (!is_one_of_several) return RegisterWithCheckpoints(inputs, context);
  registration::RegistrationHooks hooks;
  hooks.progress = context.RegistrationProgress(inputs.target_index);
  return RegisterOrRefine(inputs, hooks, context);
}

// Joint progress of several tasks that run side by side, each on its own threads.
class SharedProgress {
 public:
  SharedProgress(size_t count, std::function<void(double)> report)
      : report_(std::move(report)), done_(count, 0.0) {}

  std::function<void(double)> Of(size_t n) {
    return [this, n](double fraction) {
      const absl::MutexLock lock(&mutex_);
      done_[n] = fraction;
      const double sum = std::accumulate(done_.begin(), done_.end(), 0.0);
      report_(sum / static_cast<double>(done_.size()));
    };
  }

 private:
  const std::function<void(double)> report_;
  absl::Mutex mutex_;
  std::vector<double> done_ ABSL_GUARDED_BY(mutex_);
};

absl::StatusOr<BuiltMesh> BuildMesh(const MeshInput& input, const store::v1::RegisterJob& job,
                                    const std::function<void(double)>& progress,
                                    JobContext& context) {
  LB_RETURN_IF_ERROR(context.keeper.Check());
  spacetime::BuildOptions options = ToBuildOptions(job.space_time());
  LB_ASSIGN_OR_RETURN(mesh::Animation animation, ReadStored(input.id, context));
  LB_ASSIGN_OR_RETURN(options.connectivity,
                      spacetime::ChooseConnectivity(animation, options, context.arena));
  const bool is_tracked = options.connectivity == spacetime::Connectivity::kTracked;
  const registration::PreRoll* const pre_roll = is_tracked ? nullptr : input.pre_roll;
  AddPreRoll(pre_roll, animation);
  BuiltMesh built;
  LB_ASSIGN_OR_RETURN(built.mesh,
                      BuildWithPreRoll(animation, pre_roll, options, context.arena, progress));
  built.report = spacetime::Report(animation, built.mesh, options, context.arena);
  return built;
}

}  // namespace

absl::StatusOr<mesh::Animation> ReadStored(const std::string& id, JobContext& context) {
  LB_ASSIGN_OR_RETURN(const store::v1::AnimationRecord record, context.catalog.GetAnimation(id));
  LB_ASSIGN_OR_RETURN(const std::shared_ptr<const store::Blob> blob,
                      context.blobs.Open(record.blob()));
  absl::StatusOr<mesh::Animation> animation =
      store::ReadAnimation(*blob, absl::StrCat("animation '", id, "'"));
  LB_RETURN_IF_ERROR(blob->Check());
  return animation;
}

absl::StatusOr<std::vector<BuiltMesh>> BuildMeshes(const std::vector<MeshInput>& inputs,
                                                   const store::v1::RegisterJob& job,
                                                   JobContext& context) {
  SharedProgress progress(inputs.size(), context.StageProgress());
  std::vector<absl::StatusOr<BuiltMesh>> built(inputs.size());
  context.arena.Run(static_cast<int64_t>(inputs.size()), [&](int64_t n) {
    built[n] = BuildMesh(inputs[n], job, progress.Of(n), context);
  });
  std::vector<BuiltMesh> meshes;
  for (absl::StatusOr<BuiltMesh>& one : built) {
    if (!one.ok()) return one.status();
    meshes.push_back(*std::move(one));
  }
  return meshes;
}

absl::StatusOr<RegisteredTarget> RegisterTarget(const store::v1::RegisterJob& job, int target_index,
                                                const SourceMesh& source, const BuiltMesh& target,
                                                const mesh::RegisteredFamily* previous,
                                                const StageRange& range, JobContext& context) {
  LB_RETURN_IF_ERROR(context.BeginStage("registration", range.begin, range.end));
  RegisteredTarget result;
  result.name = job.targets(target_index);
  result.space_time = target.report;
  LB_ASSIGN_OR_RETURN(result.registration,
                      RegisterInputs({job, target_index, source, target.mesh, previous}, context));
  return result;
}

}  // namespace liquidblend::jobs

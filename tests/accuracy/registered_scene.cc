#include "tests/accuracy/registered_scene.h"

#include <sys/resource.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "tests/synthetic/slice_family.h"
#include "worker/jobs/assemble_family.h"
#include "worker/jobs/pre_roll.h"
#include "worker/jobs/register_meshes.h"
#include "worker/registration/features/pre_roll.h"
#include "worker/spacetime/build.h"

namespace liquidblend::accuracy {
namespace {

double PeakMegabytes() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

absl::Status Named(const std::string& name, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(name, ": ", std::string(status.message())));
}

Eigen::AlignedBox3f BoxOf(const mesh::Animation& animation) {
  const Eigen::Matrix<float, 3, 2> bounds = mesh::Bounds(animation);
  return Eigen::AlignedBox3f(bounds.col(0), bounds.col(1));
}

absl::StatusOr<mesh::SpaceTimeMesh> Build(const mesh::Animation& animation,
                                          const registration::PreRoll* pre_roll,
                                          const parallel::Arena& arena, Costs& costs) {
  const absl::Time start = absl::Now();
  auto mesh = jobs::BuildWithPreRoll(animation, pre_roll, {}, arena);
  if (!mesh.ok()) return Named(animation.name, mesh.status());
  costs.build_s += absl::ToDoubleSeconds(absl::Now() - start);
  return mesh;
}

std::optional<registration::PreRoll> PreRollOf(const std::vector<mesh::Animation>& inputs,
                                               const registration::RegistrationOptions& options) {
  if (!options.automatic_correspondences) return std::nullopt;
  std::vector<mesh::TriangleMesh> targets;
  for (size_t k = 1; k < inputs.size(); ++k) targets.push_back(inputs[k].frames[0]);
  return registration::FindPreRoll(
      inputs[0].frames[0], targets, inputs[0].up,
      {options.smallest_part_edges, spacetime::BuildOptions().DropletArea()});
}

jobs::TimeBlending TimeBlendingOf(const Scene& scene, const jobs::FamilyContents& contents) {
  if (!scene.times) {
    return jobs::ChooseTimeBlending(contents.targets, contents.source.frames_per_second);
  }
  if (scene.times == TimeKind::kSquares) return {0.0};
  return {};
}

}  // namespace

absl::StatusOr<RegisteredScene> RegisteredScene::Register(
    const Scene& scene,
    const std::vector<std::vector<registration::Correspondence>>& correspondences,
    const registration::RegistrationOptions& options, const parallel::Arena& arena) {
  RegisteredScene result;
  jobs::FamilyContents contents;
  contents.name = scene.name;
  contents.source_name = scene.inputs[0].name;
  const std::optional<registration::PreRoll> found = PreRollOf(scene.inputs, options);
  const registration::PreRoll* const pre_roll = jobs::PointerTo(found);
  mesh::Animation source = scene.inputs[0];
  jobs::AddPreRoll(pre_roll, source);
  LB_ASSIGN_OR_RETURN(contents.source, Build(source, pre_roll, arena, result.costs_));
  source = {};
  contents.bounds = BoxOf(scene.inputs[0]);
  for (size_t k = 1; k < scene.inputs.size(); ++k) {
    const mesh::Animation& input = scene.inputs[k];
    LB_ASSIGN_OR_RETURN(const mesh::SpaceTimeMesh target,
                        Build(input, nullptr, arena, result.costs_));
    contents.bounds.extend(BoxOf(input));
    const std::vector<registration::Correspondence> none;
    const auto read = [](const mesh::Animation& animation) { return [&] { return animation; }; };
    auto registered = jobs::RegisterMeshes(
        {contents.source, read(scene.inputs[0]), pre_roll}, {target, read(input)},
        correspondences.empty() ? none : correspondences[k - 1], nullptr, {{}, options}, arena);
    if (!registered.ok()) return Named(input.name, registered.status());
    result.costs_.registration_s.push_back(registered->report.seconds);
    jobs::RegisteredTarget& added = contents.targets.emplace_back();
    added.name = input.name;
    added.registration = *std::move(registered);
  }
  contents.time_blending = TimeBlendingOf(scene, contents);
  result.costs_.peak_mb = PeakMegabytes();
  LB_ASSIGN_OR_RETURN(mesh::RegisteredFamily family, jobs::AssembleFamily(std::move(contents)));
  result.family_ = std::make_unique<mesh::RegisteredFamily>(std::move(family));
  result.index_ = std::make_unique<slice::CellIndex>(*result.family_);
  result.life_limits_ = blend::LifeLimits(*result.family_);
  return result;
}

mesh::TriangleMesh RegisteredScene::Cut(std::vector<double> weights, double frame) const {
  life_limits_.Clamp(weights);
  const double time_s = std::min(frame / family_->frames_per_second, family_->duration_s());
  return synthetic::SliceFamily(*index_, weights, time_s);
}

}  // namespace liquidblend::accuracy

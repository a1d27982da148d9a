#include "worker/jobs/pre_roll.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/files/files.h"
#include "worker/jobs/job_options.h"

namespace liquidblend::jobs {
namespace {

struct FirstFrame {
  mesh::TriangleMesh surface;
  mesh::Up up = mesh::Up::kUnknown;
};

absl::StatusOr<FirstFrame> ReadFirstFrame(const std::string& id, JobContext& context) {
  LB_RETURN_IF_ERROR(context.keeper.Check());
  LB_ASSIGN_OR_RETURN(const store::v1::AnimationRecord record, context.catalog.GetAnimation(id));
  LB_ASSIGN_OR_RETURN(const std::shared_ptr<const store::Blob> blob,
                      context.blobs.Open(record.blob()));
  LB_ASSIGN_OR_RETURN(const auto frames,
                      store::AnimationFrames::Open(blob, absl::StrCat("animation '", id, "'")));
  FirstFrame first;
  first.up = static_cast<mesh::Up>(frames->manifest().up());  // the same numbers
  absl::StatusOr<mesh::TriangleMesh> surface = frames->Read(0);
  LB_RETURN_IF_ERROR(blob->Check());
  LB_ASSIGN_OR_RETURN(first.surface, std::move(surface));
  return first;
}

}  // namespace

absl::StatusOr<std::optional<registration::PreRoll>> ReadPreRoll(
    const store::v1::RegisterJob& job, const mesh::RegisteredFamily* previous,
    JobContext& context) {
  const registration::RegistrationOptions options = ToRegistrationOptions(job.options());
  const bool is_wanted = previous != nullptr ? previous->num_pre_roll > 0
                                             : options.IsGuidedBy(registration::Pairing::kFound);
  if (!is_wanted) return std::nullopt;
  LB_ASSIGN_OR_RETURN(const FirstFrame source, ReadFirstFrame(job.source(), context));
  std::vector<mesh::TriangleMesh> targets;
  for (const std::string& id : job.targets()) {
    LB_ASSIGN_OR_RETURN(FirstFrame target, ReadFirstFrame(id, context));
    targets.push_back(std::move(target.surface));
  }
  return registration::FindPreRoll(
      source.surface, targets, source.up,
      {options.smallest_part_edges, ToBuildOptions(job.space_time()).DropletArea()});
}

void AddPreRoll(const registration::PreRoll* pre_roll, mesh::Animation& animation) {
  if (pre_roll == nullptr) return;
  // A short animation gets a short one, so that the memory it takes stays in proportion.
  const int count = std::min(registration::kPreRollFrames, animation.num_frames());
  mesh::AddPreRoll(pre_roll->surface, count, animation);
}

absl::StatusOr<mesh::SpaceTimeMesh> BuildWithPreRoll(const mesh::Animation& animation,
                                                     const registration::PreRoll* pre_roll,
                                                     const spacetime::BuildOptions& options,
                                                     const parallel::Arena& arena,
                                                     const std::function<void(double)>& progress) {
  LB_ASSIGN_OR_RETURN(mesh::SpaceTimeMesh mesh,
                      spacetime::Build(animation, options, arena, progress));
  if (pre_roll != nullptr) registration::LowerParts(*pre_roll, arena, mesh);
  return mesh;
}

}  // namespace liquidblend::jobs

#include "server/api/check_animations.h"

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "core/mesh/up.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

using store::pb::AnimationManifest;

// Nothing: there is no such animation, or it is not ready.
using Manifest = std::optional<AnimationManifest>;

absl::StatusOr<Manifest> ManifestOf(store::Catalog& catalog, const std::string& id) {
  const absl::StatusOr<store::pb::AnimationRecord> animation = catalog.GetAnimation(id);
  if (absl::IsNotFound(animation.status())) return Manifest();
  LB_RETURN_IF_ERROR(animation.status());
  if (animation->state() != store::pb::AnimationRecord::READY) return Manifest();
  return Manifest(animation->manifest());
}

// The space-time mesh ends at the last whole frame.
double DurationS(const AnimationManifest& manifest) {
  const auto& times = manifest.times();
  const double last = times.empty() ? manifest.num_frames() - 1 : times[times.size() - 1];
  return std::floor(last) / manifest.frames_per_second();
}

void CheckContents(const std::string& field, const std::string& id,
                   const AnimationManifest& manifest, FieldViolations& violations) {
  violations.AddIf(manifest.num_frames() < 2, field,
                   absl::StrCat("animation '", id, "' has ", manifest.num_frames(),
                                " frames; a registration needs 2 or more of each animation"));
  violations.AddIf(!(manifest.mean_edge_length_m() > 0), field,
                   absl::StrCat("animation '", id, "' has no liquid in any frame"));
}

void CheckFrameRate(const std::string& field, const std::string& id,
                    const AnimationManifest& manifest, const store::pb::RegisterJob& job,
                    const AnimationManifest& source, FieldViolations& violations) {
  const double rate = manifest.frames_per_second();
  violations.AddIf(
      !mesh::IsSameFrameRate(rate, source.frames_per_second()), field,
      absl::StrCat("animation '", id, "' has ", rate, " frames per second, but the source '",
                   job.source(), "' has ", source.frames_per_second(),
                   "; both must have the same: import one of them again with its true rate (--fps)"
                   ", or export the frames of one at the rate of the other"));
}

mesh::Up UpOf(const AnimationManifest& manifest) {
  const int up = manifest.up();
  return store::pb::Up_IsValid(up) ? static_cast<mesh::Up>(up) : mesh::Up::kUnknown;
}

// Gravity points the same way in all animations of a family.
void CheckUp(const std::string& field, const std::string& id, const AnimationManifest& manifest,
             const store::pb::RegisterJob& job, const AnimationManifest& source,
             FieldViolations& violations) {
  const mesh::Up up = UpOf(manifest), source_up = UpOf(source);
  violations.AddIf(
      mesh::AxisOf(up) != mesh::AxisOf(source_up), field,
      absl::StrCat("animation '", id, "' has ", mesh::DescribeUp(up), " up, but the source '",
                   job.source(), "' has ", mesh::DescribeUp(source_up),
                   " up; import the one that is wrong again with `up` given (--up), or turn its "
                   "files"));
}

void CheckTime(const std::string& field, const std::string& id, double time_s,
               const AnimationManifest& manifest, FieldViolations& violations) {
  const double duration_s = DurationS(manifest);
  violations.AddIf(
      time_s > duration_s, absl::StrCat(field, ".time_s"),
      absl::StrCat("is ", time_s, " s, but animation '", id, "' ends at ", duration_s, " s"));
}

void CheckCorrespondenceTimes(const store::pb::RegisterJob& job, int target_index,
                              const AnimationManifest& source, const AnimationManifest& target,
                              FieldViolations& violations) {
  if (target_index >= job.correspondences_size()) return;
  const auto& list = job.correspondences(target_index).correspondences();
  for (int i = 0; i < list.size(); ++i) {
    const std::string field =
        absl::StrCat("correspondences[", target_index, "].correspondences[", i, "]");
    CheckTime(field + ".source", job.source(), list[i].source(3), source, violations);
    CheckTime(field + ".target", job.targets(target_index), list[i].target(3), target, violations);
  }
}

}  // namespace

absl::Status CheckAnimations(store::Catalog& catalog, const store::pb::RegisterJob& job) {
  FieldViolations violations;
  LB_ASSIGN_OR_RETURN(const Manifest source, ManifestOf(catalog, job.source()));
  if (source) CheckContents("source", job.source(), *source, violations);
  for (int k = 0; k < job.targets_size(); ++k) {
    LB_ASSIGN_OR_RETURN(const Manifest target, ManifestOf(catalog, job.targets(k)));
    if (!target) continue;
    const std::string field = absl::StrCat("targets[", k, "]");
    CheckContents(field, job.targets(k), *target, violations);
    if (!source) continue;
    CheckFrameRate(field, job.targets(k), *target, job, *source, violations);
    CheckUp(field, job.targets(k), *target, job, *source, violations);
    CheckCorrespondenceTimes(job, k, *source, *target, violations);
  }
  return violations.ToStatus();
}

}  // namespace liquidblend::server

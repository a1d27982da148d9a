#include "worker/jobs/previous_version.h"

#include <Eigen/Core>
#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "core/store/files/files.h"
#include "worker/jobs/job_options.h"
#include "worker/registration/surface/correspondence.h"

namespace liquidblend::jobs {
namespace {

constexpr float kSameVertexEdges = 0.1f;

absl::Status CheckSameAnimations(const store::v1::RegisterJob& job,
                                 const mesh::RegisteredFamily& family) {
  std::vector<std::string> targets;
  for (const mesh::FamilyTarget& target : family.targets) targets.push_back(target.name);
  if (job.source() == family.source &&
      std::equal(targets.begin(), targets.end(), job.targets().begin(), job.targets().end())) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "family '", job.family(), "' is of ", family.source, " -> ", absl::StrJoin(targets, ", "),
      ", which cannot be refined into ", job.source(), " -> ", absl::StrJoin(job.targets(), ", ")));
}

// The user's, or none of the automatic ones where there were some.
bool HasNewCorrespondences(const store::v1::RegisterJob& job, int k,
                           const mesh::RegisteredFamily& previous) {
  std::vector<mesh::Correspondence> before;
  bool had_automatic = false;
  for (const mesh::CorrespondenceReport& report : previous.targets[k].report.correspondences) {
    if (!report.automatic) before.push_back(report.correspondence);
    had_automatic |= report.automatic;
  }
  const registration::RegistrationOptions options = ToRegistrationOptions(job.options());
  if (had_automatic && !options.IsGuidedBy(registration::Pairing::kFound)) return true;
  const auto now = ToCorrespondences(job, k, previous.frames_per_second);
  return !std::equal(before.begin(), before.end(), now.begin(), now.end(), registration::IsSame);
}

}  // namespace

mesh::RegisteredFamily InFrames(const mesh::RegisteredFamily& family) {
  struct Arrays {
    Eigen::Matrix4Xf vertices;
    std::vector<Eigen::Matrix4Xf> displacements;
  };
  const mesh::TimeAxis axis = family.time_axis();
  const auto arrays = std::make_shared<Arrays>();
  arrays->vertices = MatrixOf(family.vertices);
  arrays->displacements.reserve(2 * family.targets.size());
  axis.ToFrames(arrays->vertices);
  const auto add = [&](std::span<const mesh::Float4> displacement) {
    Eigen::Matrix4Xf matrix = MatrixOf(displacement);
    axis.ToFrames(arrays->vertices, matrix);
    return ColumnsOf(arrays->displacements.emplace_back(std::move(matrix)));
  };
  mesh::RegisteredFamily result = family;
  result.rest_time_s.reset();
  result.coarser_levels.clear();
  result.vertices = ColumnsOf(arrays->vertices);
  for (mesh::FamilyTarget& target : result.targets) {
    target.displacement = add(target.displacement);
    target.extrapolation = add(target.extrapolation);
  }
  result.storage =
      std::make_shared<std::pair<std::shared_ptr<const void>, std::shared_ptr<Arrays>>>(
          family.storage, arrays);
  return result;
}

absl::Status PreviousVersion::CheckFile() const {
  if (file == nullptr) return absl::OkStatus();
  const absl::Status readable = file->Check();
  if (readable.ok()) return readable;
  return absl::Status(readable.code(), absl::StrCat("the version to refine: ", readable.message()));
}

absl::StatusOr<PreviousVersion> OpenPreviousVersion(const store::v1::RegisterJob& job,
                                                    JobContext& context) {
  PreviousVersion previous;
  if (job.refine_version() == 0) return previous;
  LB_ASSIGN_OR_RETURN(const store::v1::FamilyRecord record,
                      context.catalog.GetFamily(job.family()));
  if (record.version() != job.refine_version()) {
    return absl::FailedPreconditionError(absl::StrCat(
        "family '", job.family(), "' is at version ", record.version(),
        " by now, and a refinement of version ", job.refine_version(), " was asked for"));
  }
  LB_ASSIGN_OR_RETURN(previous.file, context.blobs.Open(record.blob()));
  absl::StatusOr<mesh::RegisteredFamily> family =
      store::OpenFamily(previous.file, absl::StrCat("family '", job.family(), "'"));
  LB_RETURN_IF_ERROR(previous.CheckFile());
  LB_RETURN_IF_ERROR(family.status());
  LB_RETURN_IF_ERROR(CheckSameAnimations(job, *family));
  const bool is_in_frames = !family->rest_time_s && family->num_pre_roll == 0;
  previous.family = is_in_frames ? *std::move(family) : InFrames(*family);
  return previous;
}

absl::Status CheckSameVertices(const mesh::RegisteredFamily& family,
                               const mesh::SpaceTimeMesh& source) {
  const char* const advice =
      "; a refinement needs the options of space-time meshes that the family was registered with";
  const int64_t count = static_cast<int64_t>(family.vertices.size());
  if (count != source.num_vertices()) {
    return absl::InvalidArgumentError(absl::StrCat("the family has ", count,
                                                   " space-time vertices, and now the source has ",
                                                   source.num_vertices(), advice));
  }
  const float tolerance = kSameVertexEdges * static_cast<float>(source.edge_length_m);
  for (int64_t v = 0; v < count; ++v) {
    const Eigen::Map<const Eigen::Vector4f> before(family.vertices[v].data());
    const Eigen::Vector4f difference = before - source.vertices.col(v);
    if (!(difference.head<3>().norm() <= tolerance) ||
        !(std::abs(difference[3]) <= kSameVertexEdges)) {
      return absl::InvalidArgumentError(
          absl::StrCat("space-time vertex ", v, " is not where it was in the family", advice));
    }
  }
  return absl::OkStatus();
}

std::vector<mesh::Correspondence> CorrespondencesOf(const mesh::FamilyTarget& target) {
  std::vector<mesh::Correspondence> result;
  for (const auto& report : target.report.correspondences) result.push_back(report.correspondence);
  return result;
}

bool IsKept(const store::v1::RegisterJob& job, int target_index,
            const mesh::RegisteredFamily& previous) {
  if (previous.space_time_reports.empty()) return false;  // older programs made none: to be made
  if (HasNewCorrespondences(job, target_index, previous)) return false;
  for (int k = 0; k < job.targets_size(); ++k) {
    if (HasNewCorrespondences(job, k, previous)) return true;
  }
  return false;
}

RegisteredTarget KeptTarget(const mesh::RegisteredFamily& previous, int target_index) {
  const mesh::FamilyTarget& target = previous.targets[target_index];
  RegisteredTarget kept;
  kept.name = target.name;
  kept.space_time = previous.space_time_reports[target_index + 1];  // behind the source's
  kept.registration.displacement = MatrixOf(target.displacement);
  kept.registration.extrapolation = MatrixOf(target.extrapolation);
  kept.registration.report = target.report;
  return kept;
}

}  // namespace liquidblend::jobs

#include "worker/jobs/assemble_family.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/mesh/option_ranges.h"
#include "worker/registration/features/rest.h"

namespace liquidblend::jobs {
namespace {

static_assert(sizeof(mesh::Float4) == 4 * sizeof(float));

mesh::FamilyTarget TargetOf(const std::string& name,
                            const registration::Registration& registration) {
  mesh::FamilyTarget result;
  result.name = name;
  result.displacement = ColumnsOf(registration.displacement);
  result.extrapolation = ColumnsOf(registration.extrapolation);
  result.report = registration.report;
  return result;
}

void SetDomain(const FamilyContents& contents, mesh::RegisteredFamily& family) {
  const float margin_m = static_cast<float>(contents.source.edge_length_m);
  for (int axis = 0; axis < 3; ++axis) {
    family.domain_min[axis] = contents.bounds.min()[axis] - margin_m;
    family.domain_max[axis] = contents.bounds.max()[axis] + margin_m;
  }
}

void ToTicks(const mesh::TimeAxis& axis, mesh::SpaceTimeMesh& mesh,
             std::span<registration::Registration* const> targets) {
  for (registration::Registration* const target : targets) {
    axis.ToTicks(mesh.vertices, target->displacement);
    axis.ToTicks(mesh.vertices, target->extrapolation);
  }
  axis.ToTicks(mesh.vertices);
}

void ToTicks(FamilyContents& contents) {
  const mesh::TimeAxis axis(contents.time_blending.rest_time_s, contents.source.frames_per_second,
                            contents.source.num_frames, contents.source.num_pre_roll);
  std::vector<registration::Registration*> targets;
  for (RegisteredTarget& target : contents.targets) targets.push_back(&target.registration);
  ToTicks(axis, contents.source, targets);
  for (FamilyLevel& level : contents.coarser_levels) {
    targets.clear();
    for (registration::Registration& target : level.targets) targets.push_back(&target);
    ToTicks(axis, level.mesh, targets);
  }
}

// A level of the family, on the level's mesh.
mesh::RegisteredFamily LevelOf(const FamilyLevel& level, const mesh::RegisteredFamily& family) {
  mesh::RegisteredFamily result = mesh::ViewOf(level.mesh);
  result.name = family.name;
  result.source = family.source;
  result.rest_time_s = family.rest_time_s;
  result.edge_length_m = family.edge_length_m;
  result.domain_min = family.domain_min;
  result.domain_max = family.domain_max;
  for (size_t k = 0; k < level.targets.size(); ++k) {
    result.targets.push_back(TargetOf(family.targets[k].name, level.targets[k]));
    result.targets.back().report = family.targets[k].report;
  }
  return result;
}

}  // namespace

mesh::FamilyTarget ViewOf(const RegisteredTarget& target) {
  return TargetOf(target.name, target.registration);
}

std::span<const mesh::Float4> ColumnsOf(const Eigen::Matrix4Xf& matrix) {
  return {reinterpret_cast<const mesh::Float4*>(matrix.data()), static_cast<size_t>(matrix.cols())};
}

Eigen::Matrix4Xf MatrixOf(std::span<const mesh::Float4> elements) {
  Eigen::Matrix4Xf matrix(4, static_cast<Eigen::Index>(elements.size()));
  for (Eigen::Index v = 0; v < matrix.cols(); ++v) {
    matrix.col(v) = Eigen::Map<const Eigen::Vector4f>(elements[v].data());
  }
  return matrix;
}

TimeBlending ChooseTimeBlending(const std::vector<RegisteredTarget>& targets,
                                double frames_per_second) {
  if (targets.empty()) return {};
  double sum = 0, earliest = std::numeric_limits<double>::infinity(),
         latest = -std::numeric_limits<double>::infinity();
  for (const RegisteredTarget& target : targets) {
    const mesh::RestReport& rest = target.registration.report.rest;
    if (!rest.is_from_rest) {
      return {{},
              absl::StrCat(target.name, ": ",
                           rest.reason.empty() ? "an older program registered it" : rest.reason)};
    }
    sum += rest.time_frames;
    earliest = std::min(earliest, rest.time_frames);
    latest = std::max(latest, rest.time_frames);
  }
  if (latest - earliest > registration::kSameRestFrames) {
    return {{},
            absl::StrFormat("liquid was at rest at different times in the targets, %.1f "
                            "frames apart",
                            latest - earliest)};
  }
  const double rest_time_s = sum / static_cast<double>(targets.size()) / frames_per_second;
  return {
      std::max(rest_time_s, mesh::kRestTimeS.min),
      absl::StrCat(targets.front().name, ": ", targets.front().registration.report.rest.reason)};
}

absl::StatusOr<mesh::RegisteredFamily> AssembleFamily(FamilyContents contents) {
  ToTicks(contents);
  const auto owned = std::make_shared<const FamilyContents>(std::move(contents));
  mesh::RegisteredFamily family = mesh::ViewOf(owned->source);
  family.storage = owned;
  family.name = owned->name;
  family.source = owned->source_name;
  family.parameter_space = owned->parameter_space;
  family.rest_time_s = owned->time_blending.rest_time_s;
  family.time_blending_reason = owned->time_blending.reason;
  family.space_time_reports.push_back(owned->source_report);
  for (const RegisteredTarget& target : owned->targets) {
    family.targets.push_back(ViewOf(target));
    family.space_time_reports.push_back(target.space_time);
  }
  SetDomain(*owned, family);
  for (const FamilyLevel& level : owned->coarser_levels) {
    family.coarser_levels.push_back(LevelOf(level, family));
  }
  const absl::Status status = mesh::Validate(family);
  if (!status.ok()) {
    return absl::InternalError(
        absl::StrCat("family '", family.name, "' is not valid: ", status.message()));
  }
  return family;
}

}  // namespace liquidblend::jobs

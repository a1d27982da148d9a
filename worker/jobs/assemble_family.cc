#include "worker/jobs/assemble_family.h"

#include <memory>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"

namespace liquidblend::jobs {
namespace {

static_assert(sizeof(mesh::Float4) == 4 * sizeof(float));

// A column of the matrix is an element of the span.
std::span<const mesh::Float4> ColumnsOf(const Eigen::Matrix4Xf& matrix) {
  return {reinterpret_cast<const mesh::Float4*>(matrix.data()), static_cast<size_t>(matrix.cols())};
}

mesh::FamilyTarget TargetOf(const RegisteredTarget& target) {
  mesh::FamilyTarget result;
  result.name = target.name;
  result.displacement = ColumnsOf(target.registration.displacement);
  result.extrapolation = ColumnsOf(target.registration.extrapolation);
  result.report = target.registration.report;
  return result;
}

void SetDomain(const FamilyParts& parts, mesh::RegisteredFamily& family) {
  const float margin_m = static_cast<float>(parts.source.edge_length_m);
  for (int axis = 0; axis < 3; ++axis) {
    family.domain_min[axis] = parts.bounds.min()[axis] - margin_m;
    family.domain_max[axis] = parts.bounds.max()[axis] + margin_m;
  }
}

}  // namespace

Eigen::AlignedBox3f BoxOf(const mesh::Animation& animation) {
  const Eigen::Matrix<float, 3, 2> bounds = mesh::Bounds(animation);
  return Eigen::AlignedBox3f(bounds.col(0), bounds.col(1));
}

absl::StatusOr<mesh::RegisteredFamily> AssembleFamily(FamilyParts parts) {
  const auto owned = std::make_shared<const FamilyParts>(std::move(parts));
  mesh::RegisteredFamily family = mesh::ViewOf(owned->source);
  family.storage = owned;
  family.name = owned->name;
  family.source = owned->source_name;
  for (const RegisteredTarget& target : owned->targets) {
    family.targets.push_back(TargetOf(target));
  }
  SetDomain(*owned, family);
  const absl::Status status = mesh::Validate(family);
  if (!status.ok()) {
    return absl::InternalError(
        absl::StrCat("family '", family.name, "' is not valid: ", status.message()));
  }
  return family;
}

}  // namespace liquidblend::jobs

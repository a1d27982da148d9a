#include "server/api/refine_request.h"

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "server/api/api_messages.h"
#include "server/base/errors.h"
#include "server/base/names.h"

namespace liquidblend::server {
namespace {

// Takes the family's points and interpolation where the request has none of its own.
void CompleteParameterSpace(const store::pb::FamilyManifest& manifest,
                            v1::RegisterFamilyRequest& request) {
  if (!manifest.has_parameter_space()) return;
  const v1::ParameterSpace kept = ToParameterSpace(manifest.parameter_space());
  v1::ParameterSpace& space = *request.mutable_parameter_space();
  const auto interpolation = space.interpolation();
  if (space.names().empty() && space.points().empty()) space = kept;
  space.set_interpolation(interpolation != v1::ParameterSpace::INTERPOLATION_UNSPECIFIED
                              ? interpolation
                              : kept.interpolation());
}

}  // namespace

absl::StatusOr<int64_t> CompleteRefinement(store::Catalog& catalog,
                                           v1::RegisterFamilyRequest& request) {
  LB_ASSIGN_OR_RETURN(const store::pb::FamilyRecord family, catalog.GetFamily(request.family_id()));
  if (family.version() == 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "family '", family.id(), "' has no finished version yet that could be refined"));
  }
  const std::string source = AnimationName(family.manifest().source());
  std::vector<std::string> targets;
  for (const std::string& id : family.manifest().targets()) targets.push_back(AnimationName(id));
  if (request.source().empty()) request.set_source(source);
  if (request.targets().empty()) request.mutable_targets()->Assign(targets.begin(), targets.end());
  CompleteParameterSpace(family.manifest(), request);
  if (request.time_blending().kind() == v1::TimeBlending::KIND_UNSPECIFIED &&
      request.time_blending().rest_time_s() == 0) {
    *request.mutable_time_blending() = ToTimeBlending(family.manifest());
  }
  FieldViolations violations;
  violations.AddIf(
      request.source() != source, "source",
      absl::StrCat("the family to be refined has ", source, ", got ", request.source()));
  violations.AddIf(!std::equal(targets.begin(), targets.end(), request.targets().begin(),
                               request.targets().end()),
                   "targets",
                   absl::StrCat("the family to be refined has ", absl::StrJoin(targets, ", "),
                                ", got ", absl::StrJoin(request.targets(), ", ")));
  LB_RETURN_IF_ERROR(violations.ToStatus());
  return family.version();
}

}  // namespace liquidblend::server

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "core/mesh/parameter_space.h"
#include "core/mesh/registration_options.h"
#include "core/parameters/interpolator.h"
#include "core/store/files/message_fields.h"
#include "core/store/files/parameter_records.h"
#include "server/access/owner_limits.h"
#include "server/api/api_messages.h"
#include "server/api/check_animations.h"
#include "server/api/handlers.h"
#include "server/api/job_memory.h"
#include "server/api/refine_request.h"
#include "server/api/served_operation.h"
#include "server/api/store_space.h"
#include "server/api/submission.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/base/request_id.h"

namespace liquidblend::server {
namespace {

void CheckRange(absl::string_view field, double value, const mesh::Range& range,
                FieldViolations& violations) {
  violations.AddIf(!range.Holds(value), field,
                   absl::StrCat("must be in [", range.min, ", ", range.max, "], got ", value));
}

// The field may be 0, which stands for the default.
void CheckRangeOrZero(absl::string_view field, double value, const mesh::Range& range,
                      FieldViolations& violations) {
  violations.AddIf(value != 0 && !range.Holds(value), field,
                   absl::StrCat("must be 0 or in [", range.min, ", ", range.max, "], got ", value));
}

// An option that is 0, or not set, has its default.
void CheckOptions(const v1::RegistrationOptions& options, FieldViolations& violations) {
  mesh::RegistrationOptions defaults;
  const auto check = [&](const mesh::OptionInfo& info, auto& value, const auto&...) {
    if (!store::GetField(info.name, options, value)) return;
    const std::string field = absl::StrCat("options.", info.name);
    if (info.range.Holds(0)) return CheckRange(field, double(value), info.range, violations);
    CheckRangeOrZero(field, double(value), info.range, violations);
  };
  mesh::RegistrationOptions::ForEach(defaults, check);
}

// The grid of the coarsest level of detail.
void CheckCoarsestSpacing(const v1::SpaceTimeOptions& options, FieldViolations& violations) {
  const int num_levels =
      options.has_coarser_levels() ? options.coarser_levels() : mesh::kDefaultCoarserLevels;
  const double spacing =
      options.spacing_edges() != 0 ? options.spacing_edges() : mesh::kDefaultSpacingEdges;
  if (!mesh::kCoarserLevels.Holds(num_levels) || !mesh::kSpacingEdges.Holds(spacing)) return;
  const double coarsest = spacing * mesh::LevelSpacing(num_levels);
  violations.AddIf(!mesh::kSpacingEdges.Holds(coarsest), "space_time.coarser_levels",
                   absl::StrCat("with ", num_levels, " and spacing_edges ", spacing,
                                ", the coarsest level has a spacing of ", coarsest,
                                " mean edges, above ", mesh::kSpacingEdges.max));
}

void CheckSpaceTime(const v1::SpaceTimeOptions& options, FieldViolations& violations) {
  violations.AddIf(
      !v1::Connectivity_IsValid(options.connectivity()), "space_time.connectivity",
      absl::StrCat("must be unspecified, TRACKED or REBUILT, got ", options.connectivity()));
  CheckRangeOrZero("space_time.spacing_edges", options.spacing_edges(), mesh::kSpacingEdges,
                   violations);
  CheckRange("space_time.droplet_vertices", options.droplet_vertices(), mesh::kDropletVertices,
             violations);
  CheckRange("space_time.sheet_thickness_edges", options.sheet_thickness_edges(),
             mesh::kSheetThicknessEdges, violations);
  CheckRange("space_time.coarser_levels", options.coarser_levels(), mesh::kCoarserLevels,
             violations);
  CheckCoarsestSpacing(options, violations);
}

void CheckTimeBlending(const v1::TimeBlending& blending, FieldViolations& violations) {
  violations.AddIf(
      !v1::TimeBlending::Kind_IsValid(blending.kind()), "time_blending.kind",
      absl::StrCat("must be unspecified, LINEAR, SQUARES or AUTOMATIC, got ", blending.kind()));
  if (blending.kind() == v1::TimeBlending::SQUARES) {
    CheckRange("time_blending.rest_time_s", blending.rest_time_s(), mesh::kRestTimeS, violations);
  } else {
    violations.AddIf(blending.rest_time_s() != 0, "time_blending.rest_time_s",
                     absl::StrCat("is for SQUARES only, got ", blending.rest_time_s()));
  }
}

bool IsFinite(const v1::Event& event) {
  return std::isfinite(event.position().x()) && std::isfinite(event.position().y()) &&
         std::isfinite(event.position().z());
}

void CheckEvent(const std::string& field, bool has_event, const v1::Event& event,
                FieldViolations& violations) {
  violations.AddIf(!has_event || !event.has_position(), absl::StrCat(field, ".position"),
                   "is missing");
  violations.AddIf(!IsFinite(event), absl::StrCat(field, ".position"), "must be finite");
  violations.AddIf(!(event.time_s() >= 0) || !std::isfinite(event.time_s()),
                   absl::StrCat(field, ".time_s"),
                   absl::StrCat("must be >= 0, got ", event.time_s()));
}

void CheckCorrespondence(const std::string& field, const v1::Correspondence& correspondence,
                         FieldViolations& violations) {
  violations.AddIf(correspondence.kind() < v1::Correspondence::POINT ||
                       correspondence.kind() > v1::Correspondence::SPACE,
                   absl::StrCat(field, ".kind"), "must be POINT, TRAJECTORY or SPACE");
  CheckEvent(absl::StrCat(field, ".source"), correspondence.has_source(), correspondence.source(),
             violations);
  CheckEvent(absl::StrCat(field, ".target"), correspondence.has_target(), correspondence.target(),
             violations);
  violations.AddIf(!(correspondence.length_s() >= 0) || !std::isfinite(correspondence.length_s()),
                   absl::StrCat(field, ".length_s"),
                   absl::StrCat("must be >= 0, got ", correspondence.length_s()));
}

void CheckCorrespondences(const v1::RegisterFamilyRequest& request, const Limits& limits,
                          FieldViolations& violations) {
  const int num_lists = request.correspondences_size();
  violations.AddIf(num_lists != 0 && num_lists != request.targets_size(), "correspondences",
                   absl::StrCat("there must be none or one list per target (",
                                request.targets_size(), "), got ", num_lists));
  int64_t num_all = 0;
  for (int k = 0; k < num_lists; ++k) {
    const auto& list = request.correspondences(k).correspondences();
    num_all += list.size();
    const std::string field = absl::StrCat("correspondences[", k, "].correspondences");
    if (list.size() > limits.max_correspondences) {
      violations.Add(field,
                     absl::StrCat("at most ", limits.max_correspondences, ", got ", list.size()));
      continue;
    }
    for (int i = 0; i < list.size(); ++i) {
      CheckCorrespondence(absl::StrCat(field, "[", i, "]"), list[i], violations);
    }
  }
  violations.AddIf(
      num_all > limits.max_all_correspondences, "correspondences",
      absl::StrCat("at most ", limits.max_all_correspondences, " in all, got ", num_all));
}

void CheckTargets(const v1::RegisterFamilyRequest& request, const Limits& limits,
                  FieldViolations& violations) {
  violations.AddIf(request.targets().empty(), "targets", "there must be at least one");
  violations.AddIf(request.targets_size() > limits.max_targets, "targets",
                   absl::StrCat("at most ", limits.max_targets, ", got ", request.targets_size()));
  std::set<std::string> seen = {request.source()};
  for (int k = 0; k < request.targets_size(); ++k) {
    violations.AddIf(!seen.insert(request.targets(k)).second, absl::StrCat("targets[", k, "]"),
                     absl::StrCat("is named twice: '", request.targets(k), "'"));
  }
}

absl::Status CheckParameterSpace(const v1::RegisterFamilyRequest& request, const Limits& limits) {
  const bool is_too_large = request.targets_size() > limits.max_targets;  // said elsewhere
  if (!request.has_parameter_space() || is_too_large) return absl::OkStatus();
  const mesh::ParameterSpace space = store::FromMessage(ToRecord(request.parameter_space()));
  if (space.empty() && space.interpolation == mesh::Interpolation::kSmooth) {
    return absl::InvalidArgumentError("smooth interpolation needs a point for each animation");
  }
  if (space.empty()) return absl::InvalidArgumentError("has neither names nor points");
  LB_RETURN_IF_ERROR(mesh::Validate(space, 1 + request.targets_size()));
  return parameters::Interpolator::Make(space).status();
}

// A bare id of the family, and names of the animations, however the request has them.
absl::Status CompleteNames(v1::RegisterFamilyRequest& request) {
  LB_ASSIGN_OR_RETURN(*request.mutable_family_id(), FamilyId("family_id", request.family_id()));
  const auto complete = [](std::string& name) {
    if (IsResourceId(name)) name = AnimationName(name);
  };
  complete(*request.mutable_source());
  for (std::string& target : *request.mutable_targets()) complete(target);
  return absl::OkStatus();
}

absl::Status Check(const v1::RegisterFamilyRequest& request, const Limits& limits) {
  FieldViolations violations;
  CheckTargets(request, limits, violations);
  CheckOptions(request.options(), violations);
  CheckSpaceTime(request.space_time(), violations);
  CheckTimeBlending(request.time_blending(), violations);
  CheckCorrespondences(request, limits, violations);
  const absl::Status space = CheckParameterSpace(request, limits);
  violations.AddIf(!space.ok(), "parameter_space", std::string(space.message()));
  const v1::Verdict::Grade grade = request.required_grade();
  violations.AddIf(grade != v1::Verdict::GRADE_UNSPECIFIED && grade != v1::Verdict::GOOD &&
                       grade != v1::Verdict::DOUBTFUL,
                   "required_grade",
                   absl::StrCat("must be unspecified, GOOD or DOUBTFUL, got ", grade));
  CheckPriority("priority", request.priority(), violations);
  violations.AddIf(request.request_id().size() > kMaxRequestIdLength, "request_id",
                   absl::StrCat("at most ", kMaxRequestIdLength, " characters"));
  return violations.ToStatus();
}

void SetTimeBlending(const v1::TimeBlending& blending, store::pb::RegisterJob& registration) {
  const bool is_chosen =
      blending.kind() == v1::TimeBlending::LINEAR || blending.kind() == v1::TimeBlending::SQUARES;
  registration.set_automatic_time_blending(!is_chosen);
  if (blending.kind() == v1::TimeBlending::SQUARES) {
    registration.set_rest_time_s(blending.rest_time_s());
  }
  registration.set_time_blending_reason(blending.reason());
}

absl::StatusOr<store::pb::JobRecord> JobOf(const v1::RegisterFamilyRequest& request) {
  store::pb::JobRecord job;
  job.set_request_id(request.request_id());
  job.set_priority(request.priority());
  store::pb::RegisterJob& registration = *job.mutable_register_family();
  registration.set_family(request.family_id());
  LB_ASSIGN_OR_RETURN(*registration.mutable_source(), AnimationId("source", request.source()));
  for (int k = 0; k < request.targets_size(); ++k) {
    LB_ASSIGN_OR_RETURN(*registration.add_targets(),
                        AnimationId(absl::StrCat("targets[", k, "]"), request.targets(k)));
  }
  *registration.mutable_options() = ToRecord(request.options());
  *registration.mutable_space_time() = ToRecord(request.space_time());
  if (request.has_parameter_space()) {
    *registration.mutable_parameter_space() = ToRecord(request.parameter_space());
  }
  SetTimeBlending(request.time_blending(), registration);
  for (const auto& list : request.correspondences()) {
    store::pb::RegisterJob::Correspondences& records = *registration.add_correspondences();
    for (const v1::Correspondence& correspondence : list.correspondences()) {
      *records.add_correspondences() = ToRecord(correspondence);
    }
  }
  return job;
}

absl::Status NameIsTaken(const absl::Status& status) {
  return WithReason(
      absl::AlreadyExistsError(absl::StrCat(
          std::string(status.message()),
          "; register under another name, or set replace (liquidblend register --replace) for a "
          "new version from scratch, or refine (--refine) to go on from the newest one")),
      "FAMILY_EXISTS");
}

}  // namespace

absl::StatusOr<lro::Operation> RegisterFamily(Backends& backends,
                                              const v1::RegisterFamilyRequest& asked,
                                              const Caller& caller) {
  v1::RegisterFamilyRequest request = asked;
  LB_RETURN_IF_ERROR(CompleteNames(request));
  if (request.has_time_blending()) request.mutable_time_blending()->clear_reason();
  int64_t refine_version = 0;
  if (request.refine()) {
    LB_ASSIGN_OR_RETURN(refine_version, CompleteRefinement(backends.catalog, request));
  }
  LB_RETURN_IF_ERROR(Check(request, backends.limits));
  LB_ASSIGN_OR_RETURN(store::pb::JobRecord job, JobOf(request));
  job.mutable_register_family()->set_refine_version(refine_version);
  LB_RETURN_IF_ERROR(CheckAnimations(backends.catalog, job.register_family()));
  job.mutable_register_family()->set_required_grade(
      static_cast<store::pb::Grade>(request.required_grade()));  // the same numbers
  job.mutable_register_family()->set_must_be_new(!request.replace() && !request.refine());
  job.mutable_register_family()->set_keep_versions(backends.limits.keep_versions);
  SetCaller(caller, job);
  LB_RETURN_IF_ERROR(CheckStoreSpace(backends.catalog, backends.blobs, backends.limits, job));
  LB_RETURN_IF_ERROR(NoteMemory(backends.catalog, backends.limits.worker_memory_bytes, job));
  absl::StatusOr<store::pb::JobRecord> submitted = backends.catalog.SubmitRegistration(
      std::move(job), OwnerCheckOf(caller.principal, /*new_bytes=*/0));
  if (absl::IsAlreadyExists(submitted.status())) return NameIsTaken(submitted.status());
  LB_RETURN_IF_ERROR(submitted.status());
  return ToServedOperation(backends, *submitted);
}

}  // namespace liquidblend::server

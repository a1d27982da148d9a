#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/rpc/api_messages.h"
#include "server/rpc/errors.h"
#include "server/rpc/handlers.h"
#include "server/rpc/names.h"

namespace liquidblend::rpc {
namespace {

constexpr int kMaxIterations = 200;
constexpr double kMaxNodeSpacing = 100.0;
constexpr size_t kMaxRequestIdLength = 128;

// Fields may be 0, which stands for the default.
void CheckOptions(const v1::RegistrationOptions& options, FieldViolations& violations) {
  const auto check = [&](absl::string_view field, double value, double min, double max) {
    violations.AddIf(value != 0 && !(value >= min && value <= max), absl::StrCat("options.", field),
                     absl::StrCat("must be 0 or in [", min, ", ", max, "], got ", value));
  };
  check("max_iterations", options.max_iterations(), 1, kMaxIterations);
  check("node_spacing_edges", options.node_spacing_edges(), 1, kMaxNodeSpacing);
  check("sample_share", options.sample_share(), 1e-6, 1);
  check("final_smoothness", options.final_smoothness(), 1e-9, 1e9);
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
  for (int k = 0; k < num_lists; ++k) {
    const auto& list = request.correspondences(k).correspondences();
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

absl::Status Check(const v1::RegisterFamilyRequest& request, const Limits& limits) {
  LB_RETURN_IF_ERROR(CheckId("family_id", request.family_id()));
  FieldViolations violations;
  CheckTargets(request, limits, violations);
  CheckOptions(request.options(), violations);
  CheckCorrespondences(request, limits, violations);
  violations.AddIf(request.request_id().size() > kMaxRequestIdLength, "request_id",
                   absl::StrCat("at most ", kMaxRequestIdLength, " characters"));
  return violations.ToStatus();
}

absl::StatusOr<store::pb::JobRecord> JobOf(const v1::RegisterFamilyRequest& request) {
  store::pb::JobRecord job;
  job.set_request_id(request.request_id());
  store::pb::RegisterJob& registration = *job.mutable_register_family();
  registration.set_family(request.family_id());
  LB_ASSIGN_OR_RETURN(*registration.mutable_source(), AnimationId("source", request.source()));
  for (int k = 0; k < request.targets_size(); ++k) {
    LB_ASSIGN_OR_RETURN(*registration.add_targets(),
                        AnimationId(absl::StrCat("targets[", k, "]"), request.targets(k)));
  }
  *registration.mutable_options() = ToRecord(request.options());
  for (const auto& list : request.correspondences()) {
    store::pb::RegisterJob::Correspondences& records = *registration.add_correspondences();
    for (const v1::Correspondence& correspondence : list.correspondences()) {
      *records.add_correspondences() = ToRecord(correspondence);
    }
  }
  return job;
}

}  // namespace

absl::StatusOr<lro::Operation> RegisterFamily(Backends& backends,
                                              const v1::RegisterFamilyRequest& request) {
  LB_RETURN_IF_ERROR(Check(request, backends.limits));
  LB_ASSIGN_OR_RETURN(store::pb::JobRecord job, JobOf(request));
  LB_ASSIGN_OR_RETURN(job, backends.catalog.SubmitRegistration(std::move(job)));
  return ToOperation(job, backends.catalog);
}

}  // namespace liquidblend::rpc

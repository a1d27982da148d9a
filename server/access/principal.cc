#include "server/access/principal.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "server/base/errors.h"

namespace liquidblend::server {

const char* ScopeName(Scope scope) {
  switch (scope) {
    case Scope::kFrames:
      return "frames";
    case Scope::kWrite:
      return "write";
    case Scope::kRegister:
      return "register";
  }
  return "";
}

absl::StatusOr<Scope> ParseScope(absl::string_view name) {
  for (const Scope scope : {Scope::kFrames, Scope::kWrite, Scope::kRegister}) {
    if (name == ScopeName(scope)) return scope;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("a scope is frames, write or register, got '", CleanText(name), "'"));
}

absl::Status PrincipalLimits::Validate() const {
  const auto out_of_range = [](absl::string_view field, auto value) {
    return absl::InvalidArgumentError(
        absl::StrCat("limit ", field, " is out of range: ", value, "; it must be >= 0"));
  };
  if (max_upload_bytes < 0) return out_of_range("max_upload_bytes", max_upload_bytes);
  if (max_streams < 0) return out_of_range("max_streams", max_streams);
  if (!(requests_per_second >= 0) || !std::isfinite(requests_per_second)) {
    return out_of_range("requests_per_second", requests_per_second);
  }
  if (max_stored_bytes < 0) return out_of_range("max_stored_bytes", max_stored_bytes);
  if (max_queued_jobs < 0) return out_of_range("max_queued_jobs", max_queued_jobs);
  return absl::OkStatus();
}

absl::Status CheckScope(const Principal& principal, Scope scope) {
  if (principal.scopes.count(scope) > 0) return absl::OkStatus();
  const std::string name = ScopeName(scope);
  return WithReason(
      absl::PermissionDeniedError(absl::StrCat("'", principal.name, "' lacks the scope ", name)),
      "SCOPE_MISSING", {{"scope", name}, {"principal", principal.name}});
}

}  // namespace liquidblend::server

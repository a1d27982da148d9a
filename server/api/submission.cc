#include "server/api/submission.h"

#include "absl/strings/str_cat.h"

namespace liquidblend::server {

void CheckPriority(const std::string& field, int priority, FieldViolations& violations) {
  violations.AddIf(
      priority < -kMaxPriority || priority > kMaxPriority, field,
      absl::StrCat("must be in [", -kMaxPriority, ", ", kMaxPriority, "], got ", priority));
}

void SetOwner(const Principal& principal, store::v1::JobRecord& job) {
  job.set_owner(principal.name);
}

}  // namespace liquidblend::server

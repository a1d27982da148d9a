#include "server/api/submission.h"

#include "absl/strings/str_cat.h"

namespace liquidblend::server {

void CheckPriority(const std::string& field, int priority, FieldViolations& violations) {
  violations.AddIf(
      priority < -kMaxPriority || priority > kMaxPriority, field,
      absl::StrCat("must be in [", -kMaxPriority, ", ", kMaxPriority, "], got ", priority));
}

void SetCaller(const Caller& caller, store::v1::JobRecord& job) {
  job.set_owner(caller.principal.name);
  job.set_traceparent(trace::ToTraceparent(caller.span.context()));
  job.set_tracestate(caller.span.context().state);
}

}  // namespace liquidblend::server

#include "server/access/owner_limits.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

absl::Status Exceeded(const Principal& principal, absl::string_view reason, const std::string& what,
                      int64_t limit, int64_t used, int64_t asked) {
  const std::string message =
      absl::StrCat("'", principal.name, "' may have ", limit, " ", what, " and has ", used,
                   asked > 0 ? absl::StrCat("; ", asked, " more would be needed") : "");
  return WithQuotaFailure(WithReason(absl::ResourceExhaustedError(message), reason,
                                     {{"principal", principal.name},
                                      {"limit", absl::StrCat(limit)},
                                      {"used", absl::StrCat(used)},
                                      {"needed", absl::StrCat(asked)}}),
                          absl::StrCat("principal:", principal.name), message);
}

}  // namespace

absl::Status CheckOwnerLimits(const Principal& principal, const store::OwnerUse& use,
                              int64_t new_bytes) {
  const PrincipalLimits& limits = principal.limits;
  if (limits.max_queued_jobs > 0 && use.num_queued_jobs >= limits.max_queued_jobs) {
    return Exceeded(principal, "QUEUED_JOBS_EXCEEDED", "operations that are not done",
                    limits.max_queued_jobs, use.num_queued_jobs, 1);
  }
  const int64_t left = limits.max_stored_bytes - use.stored_bytes;
  if (limits.max_stored_bytes > 0 && (left <= 0 || new_bytes > left)) {
    return Exceeded(principal, "STORED_BYTES_EXCEEDED", "bytes stored", limits.max_stored_bytes,
                    use.stored_bytes, new_bytes);
  }
  return absl::OkStatus();
}

store::OwnerCheck OwnerCheckOf(const Principal& principal, int64_t new_bytes) {
  const PrincipalLimits& limits = principal.limits;
  if (limits.max_stored_bytes == 0 && limits.max_queued_jobs == 0) return {};
  return [principal, new_bytes](const store::OwnerUse& use) {
    return CheckOwnerLimits(principal, use, new_bytes);
  };
}

}  // namespace liquidblend::server

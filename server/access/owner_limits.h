// Limits of a principal in the store and in the queue: max_stored_bytes, max_queued_jobs. Knows no
// gRPC.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "core/store/catalog/catalog.h"
#include "server/access/principal.h"

namespace liquidblend::server {

// Checks whether the principal, who has `use`, may submit a job and store new_bytes for it. The
// size of a job's result is not known beforehand: it may exceed the limit, but beyond the limit no
// job is accepted.
// Errors: kResourceExhausted (STORED_BYTES_EXCEEDED, QUEUED_JOBS_EXCEEDED) with
// google.rpc.QuotaFailure; both name the limit and the use.
absl::Status CheckOwnerLimits(const Principal& principal, const store::OwnerUse& use,
                              int64_t new_bytes);

// The same check as a function for the catalog; empty for a principal without such limits.
store::OwnerCheck OwnerCheckOf(const Principal& principal, int64_t new_bytes);

}  // namespace liquidblend::server

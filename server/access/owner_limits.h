// What a principal may have in the store and in the queue: max_stored_bytes, max_queued_jobs. Knows
// no gRPC.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "core/store/catalog/catalog.h"
#include "server/access/principal.h"

namespace liquidblend::server {

// Whether the principal, who has `use`, may submit a job, and store new_bytes for it. What a job
// will make is not known beforehand: it may lead beyond the limit, but nothing is accepted there.
// Errors: kResourceExhausted (STORED_BYTES_EXCEEDED, QUEUED_JOBS_EXCEEDED) with
// google.rpc.QuotaFailure; both name the limit and what is used.
absl::Status CheckOwnerLimits(const Principal& principal, const store::OwnerUse& use,
                              int64_t new_bytes);

// The same for the catalog to ask when it accepts a job; empty for who has no such limits.
store::OwnerCheck OwnerCheckOf(const Principal& principal, int64_t new_bytes);

}  // namespace liquidblend::server

// The order of the queue: which job is leased next, and when.
#pragma once

#include <cstdint>
#include <optional>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog_tables.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// Finds the next job or child that is queued or running, due, and needs at most memory_bytes: the
// highest priority first, of these the lowest turn, of these the oldest. A due time beyond
// kLongestLease counts as due: then the clock has been turned back.
absl::StatusOr<std::optional<JobRow>> FindJobToDo(Sql& sql, absl::Time now, int64_t memory_bytes);

// The time until FindJobToDo() may find one: 0 if there is one; infinite if none is queued or
// running.
absl::StatusOr<absl::Duration> TimeToNextJob(Sql& sql, absl::Time now, int64_t memory_bytes);

// The turn of a new job (start-time fair queueing): the next one after the last unfinished job of
// its owner and priority, but not before the last turn that was leased, nor before the job that
// waits longest. So an owner of many jobs waits for owners of few.
absl::StatusOr<int64_t> NextTurn(Sql& sql, const pb::JobRecord& job);

}  // namespace liquidblend::store

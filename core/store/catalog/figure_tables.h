// Figures of the jobs for operators (QueueFigures), in any database.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// See Catalog::MeasureQueue().
absl::StatusOr<QueueFigures> MeasureQueue(Sql& sql, absl::Time now, int64_t memory_bytes);
// See Catalog::ListEndedJobs().
absl::StatusOr<std::vector<pb::JobRecord>> FindEndedJobs(Sql& sql, absl::Time after, int max_jobs);

}  // namespace liquidblend::store
